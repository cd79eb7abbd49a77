"""Frames by VTK: a job per line of JSON on stdin, an answer per line on stdout.

    frames_vtk.py SCENE WIDTH HEIGHT FOV shadow|none

Debian's VTK draws into windows only: run it under xvfb-run. A job is {"eye", "target", "light":
{"position", "target"}, "far", "file"}; the answer {"ms"} is from there to the bytes of a PNG, which
are written to the file afterwards. Its shadows are hard: vtkShadowMapPass, 2048 texels."""
import json
import sys
import time

import vtk

scene, width, height, fov, mode = sys.argv[1:]
answers = sys.stdout
sys.stdout = sys.stderr

window = vtk.vtkRenderWindow()
window.SetOffScreenRendering(1)
window.SetSize(int(width), int(height))
window.SetMultiSamples(0)
importer = vtk.vtkGLTFImporter()
importer.SetFileName(scene)
importer.SetRenderWindow(window)
importer.Update()
renderer = importer.GetRenderer()
renderer.SetBackground(0, 0, 0)
renderer.SetUseImageBasedLighting(False)
renderer.AutomaticLightCreationOff()
renderer.RemoveAllLights()
light = vtk.vtkLight()
light.SetLightTypeToSceneLight()
light.SetPositional(True)
light.SetConeAngle(60)
light.SetExponent(0)
light.SetAttenuationValues(1, 0, 0)
renderer.AddLight(light)
for actor in renderer.GetActors():  # its shadow pass knows no physically based materials
    surface = actor.GetProperty()
    surface.SetInterpolationToPhong()
    surface.SetAmbient(0)
    surface.SetSpecular(0)
    surface.SetDiffuse(1)
if mode == "shadow":
    shadows = vtk.vtkShadowMapPass()
    shadows.GetShadowMapBakerPass().SetResolution(2048)
    passes = vtk.vtkRenderPassCollection()
    passes.AddItem(shadows.GetShadowMapBakerPass())
    passes.AddItem(shadows)
    sequence = vtk.vtkSequencePass()
    sequence.SetPasses(passes)
    through_camera = vtk.vtkCameraPass()
    through_camera.SetDelegatePass(sequence)
    renderer.SetPass(through_camera)

for line in sys.stdin:
    job = json.loads(line)
    begun = time.perf_counter()
    light.SetPosition(*job["light"]["position"])
    light.SetFocalPoint(*job["light"]["target"])
    camera = renderer.GetActiveCamera()
    camera.SetPosition(*job["eye"])
    camera.SetFocalPoint(*job["target"])
    camera.SetViewUp(0, 1, 0)
    camera.SetViewAngle(float(fov))
    camera.SetClippingRange(0.1, job["far"])
    window.Render()
    grab = vtk.vtkWindowToImageFilter()
    grab.SetInput(window)
    grab.ReadFrontBufferOff()
    grab.ShouldRerenderOff()
    writer = vtk.vtkPNGWriter()
    writer.SetInputConnection(grab.GetOutputPort())
    writer.WriteToMemoryOn()
    writer.Write()
    data = memoryview(writer.GetResult()).tobytes()
    took = 1e3 * (time.perf_counter() - begun)
    with open(job["file"], "wb") as file:
        file.write(data)
    answers.write(json.dumps({"ms": took, "about": "VTK " + vtk.vtkVersion().GetVTKVersion()}) + "\n")
    answers.flush()
