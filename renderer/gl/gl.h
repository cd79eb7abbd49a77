/* OpenGL 4.5 core, loaded at run time: nothing here links against libGL or libEGL. */
#pragma once
#include <GL/glcorearb.h>
#include <stdbool.h>

/* clang-format off */
#define GL_FUNCTIONS(F) \
    F(ACTIVETEXTURE, ActiveTexture) F(ATTACHSHADER, AttachShader) F(BEGINQUERY, BeginQuery) \
    F(BINDBUFFERBASE, BindBufferBase) F(BINDBUFFERRANGE, BindBufferRange) F(BINDBUFFER, BindBuffer) \
    F(BINDFRAMEBUFFER, BindFramebuffer) F(BINDIMAGETEXTURE, BindImageTexture) \
    F(BINDSAMPLER, BindSampler) F(BINDTEXTUREUNIT, BindTextureUnit) \
    F(BINDVERTEXARRAY, BindVertexArray) F(BLENDEQUATION, BlendEquation) \
    F(BLENDFUNC, BlendFunc) F(BLENDCOLOR, BlendColor) \
    F(CHECKNAMEDFRAMEBUFFERSTATUS, CheckNamedFramebufferStatus) \
    F(CLEARNAMEDFRAMEBUFFERFV, ClearNamedFramebufferfv) \
    F(CLEARNAMEDFRAMEBUFFERUIV, ClearNamedFramebufferuiv) \
    F(CLEARNAMEDBUFFERDATA, ClearNamedBufferData) \
    F(CLEARTEXIMAGE, ClearTexImage) F(CLIPCONTROL, ClipControl) F(COLORMASK, ColorMask) \
    F(COMPILESHADER, CompileShader) F(COPYIMAGESUBDATA, CopyImageSubData) \
    F(BLITNAMEDFRAMEBUFFER, BlitNamedFramebuffer) \
    F(CREATEBUFFERS, CreateBuffers) F(CREATEFRAMEBUFFERS, CreateFramebuffers) \
    F(CREATEPROGRAM, CreateProgram) F(CREATEQUERIES, CreateQueries) \
    F(CREATESAMPLERS, CreateSamplers) F(CREATESHADER, CreateShader) \
    F(CREATETEXTURES, CreateTextures) F(CREATEVERTEXARRAYS, CreateVertexArrays) \
    F(CULLFACE, CullFace) F(DEBUGMESSAGECALLBACK, DebugMessageCallback) \
    F(DEBUGMESSAGECONTROL, DebugMessageControl) \
    F(DELETEBUFFERS, DeleteBuffers) F(DELETEFRAMEBUFFERS, DeleteFramebuffers) \
    F(DELETEPROGRAM, DeleteProgram) F(DELETEQUERIES, DeleteQueries) \
    F(DELETESAMPLERS, DeleteSamplers) F(DELETESHADER, DeleteShader) F(DELETESYNC, DeleteSync) \
    F(DELETETEXTURES, DeleteTextures) F(DELETEVERTEXARRAYS, DeleteVertexArrays) \
    F(DEPTHFUNC, DepthFunc) F(DEPTHMASK, DepthMask) F(DISABLE, Disable) \
    F(DISPATCHCOMPUTE, DispatchCompute) F(DISPATCHCOMPUTEINDIRECT, DispatchComputeIndirect) \
    F(DRAWARRAYS, DrawArrays) F(DRAWARRAYSINSTANCED, DrawArraysInstanced) F(DRAWARRAYSINDIRECT, DrawArraysIndirect) \
    F(ENABLE, Enable) F(ENABLEVERTEXARRAYATTRIB, EnableVertexArrayAttrib) F(ENDQUERY, EndQuery) \
    F(FENCESYNC, FenceSync) F(CLIENTWAITSYNC, ClientWaitSync) \
    F(FINISH, Finish) F(FLUSH, Flush) F(FRONTFACE, FrontFace) \
    F(GENERATETEXTUREMIPMAP, GenerateTextureMipmap) F(GETERROR, GetError) \
    F(GETGRAPHICSRESETSTATUS, GetGraphicsResetStatus) F(GETINTEGERV, GetIntegerv) \
    F(GETMULTISAMPLEFV, GetMultisamplefv) \
    F(GETINTEGER64V, GetInteger64v) F(GETINTEGERI_V, GetIntegeri_v) \
    F(GETNAMEDBUFFERSUBDATA, GetNamedBufferSubData) F(GETPROGRAMINFOLOG, GetProgramInfoLog) \
    F(GETPROGRAMIV, GetProgramiv) F(GETPROGRAMRESOURCEINDEX, GetProgramResourceIndex) \
    F(GETPROGRAMRESOURCEIV, GetProgramResourceiv) F(GETQUERYOBJECTUI64V, GetQueryObjectui64v) \
    F(GETSHADERINFOLOG, GetShaderInfoLog) F(GETSHADERIV, GetShaderiv) F(GETSTRING, GetString) \
    F(GETSTRINGI, GetStringi) F(GETTEXTUREIMAGE, GetTextureImage) \
    F(GETTEXTURESUBIMAGE, GetTextureSubImage) \
    F(GETUNIFORMLOCATION, GetUniformLocation) F(LINKPROGRAM, LinkProgram) \
    F(MAPNAMEDBUFFERRANGE, MapNamedBufferRange) F(MEMORYBARRIER, MemoryBarrier) \
    F(MULTIDRAWELEMENTSINDIRECT, MultiDrawElementsIndirect) \
    F(NAMEDBUFFERDATA, NamedBufferData) F(NAMEDBUFFERSTORAGE, NamedBufferStorage) \
    F(NAMEDBUFFERSUBDATA, NamedBufferSubData) \
    F(NAMEDFRAMEBUFFERDRAWBUFFERS, NamedFramebufferDrawBuffers) \
    F(NAMEDFRAMEBUFFERREADBUFFER, NamedFramebufferReadBuffer) \
    F(NAMEDFRAMEBUFFERTEXTURE, NamedFramebufferTexture) \
    F(NAMEDFRAMEBUFFERTEXTURELAYER, NamedFramebufferTextureLayer) \
    F(PIXELSTOREI, PixelStorei) F(POLYGONOFFSET, PolygonOffset) \
    F(PROGRAMUNIFORM1F, ProgramUniform1f) F(PROGRAMUNIFORM1I, ProgramUniform1i) \
    F(PROGRAMUNIFORM1UI, ProgramUniform1ui) F(PROGRAMUNIFORM2F, ProgramUniform2f) \
    F(PROGRAMUNIFORM2I, ProgramUniform2i) F(PROGRAMUNIFORM2FV, ProgramUniform2fv) \
    F(PROGRAMUNIFORM3F, ProgramUniform3f) \
    F(PROGRAMUNIFORM4F, ProgramUniform4f) F(PROGRAMUNIFORM4FV, ProgramUniform4fv) \
    F(PROGRAMUNIFORM4I, ProgramUniform4i) F(PROGRAMUNIFORM4UI, ProgramUniform4ui) \
    F(PROGRAMUNIFORMMATRIX4FV, ProgramUniformMatrix4fv) F(QUERYCOUNTER, QueryCounter) \
    F(READPIXELS, ReadPixels) F(SAMPLERPARAMETERF, SamplerParameterf) \
    F(SAMPLERPARAMETERFV, SamplerParameterfv) F(SAMPLERPARAMETERI, SamplerParameteri) \
    F(SCISSOR, Scissor) F(SHADERSOURCE, ShaderSource) F(STENCILFUNC, StencilFunc) \
    F(STENCILOP, StencilOp) F(TEXTUREBARRIER, TextureBarrier) \
    F(TEXTUREPARAMETERI, TextureParameteri) \
    F(TEXTURESTORAGE2D, TextureStorage2D) F(TEXTURESTORAGE3D, TextureStorage3D) \
    F(TEXTURESTORAGE2DMULTISAMPLE, TextureStorage2DMultisample) \
    F(TEXTURESUBIMAGE2D, TextureSubImage2D) F(TEXTURESUBIMAGE3D, TextureSubImage3D) \
    F(TEXTUREVIEW, TextureView) \
    F(UNMAPNAMEDBUFFER, UnmapNamedBuffer) F(USEPROGRAM, UseProgram) \
    F(VERTEXARRAYATTRIBBINDING, VertexArrayAttribBinding) \
    F(VERTEXARRAYATTRIBFORMAT, VertexArrayAttribFormat) \
    F(VERTEXARRAYBINDINGDIVISOR, VertexArrayBindingDivisor) \
    F(VERTEXARRAYELEMENTBUFFER, VertexArrayElementBuffer) \
    F(VERTEXARRAYVERTEXBUFFER, VertexArrayVertexBuffer) F(VIEWPORT, Viewport)
/* clang-format on */

struct gl_api {
#define GL_DECLARE(type, name) PFNGL##type##PROC name;
    GL_FUNCTIONS(GL_DECLARE)
#undef GL_DECLARE
};
extern struct gl_api gl; /* valid on the GL thread while a context is current */
