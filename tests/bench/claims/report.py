"""The report as one static page beside its pictures: claims with verdicts and picture pairs, error
against time for every method and scene, tables and contact sheets. Reads without a script."""
import os
from html import escape

import compare_methods
import svg

STYLE = """
:root { color-scheme: light dark; --link: #0a58ca; --ink: #1c1f23; --soft: #5d6670; --line: #d8dce1; --paper: #fff; --good: #1a7f37;
  --fair: #9a6700; --bad: #b42318; --none: #6e7781; --goodfill: #cfeed8; --fairfill: #fbeec2; }
@media (prefers-color-scheme: dark) { :root { color-scheme: light dark; --link: #0a58ca; --ink: #e6e8eb; --soft: #9aa4af; --line: #363c44;
  --paper: #15181c; --good: #4ac26b; --fair: #d4a72c; --bad: #ff7b72; --none: #8b949e;
  --goodfill: #1d4428; --fairfill: #4a3d12; } }
body { font: 16px/1.5 system-ui, sans-serif; color: var(--ink); background: var(--paper);
  max-width: 1080px; margin: 2rem auto; padding: 0 1rem; }
h1, h2, h3 { line-height: 1.2; } h2 { margin-top: 3rem; border-top: 1px solid var(--line);
  padding-top: 1.5rem; }
p.soft, figcaption, td.soft, .soft { color: var(--soft); font-size: .9rem; }
.wide { overflow-x: auto; }
table { border-collapse: collapse; font-size: .9rem; width: 100%; }
th, td { text-align: left; padding: .35rem .6rem; border-bottom: 1px solid var(--line);
  vertical-align: top; }
td.n, th.n { text-align: right; font-variant-numeric: tabular-nums; white-space: nowrap; }
.reproduced { color: var(--good); } .partly { color: var(--fair); } .refuted { color: var(--bad); }
.unmeasured { color: var(--none); } td .verdict, .verdict { font-weight: 600; }
svg text { fill: var(--ink); font: 11px system-ui, sans-serif; }
svg .tick { fill: var(--soft); } svg .grid { stroke: var(--line); fill: none; }
svg .axis { font-size: 12px; fill: var(--soft); }
svg .lead { stroke: var(--soft); stroke-width: .6; fill: none; }
svg.scatter { width: 100%; height: auto; }
svg circle { fill: currentColor; } svg .bar { stroke: currentColor; stroke-width: 2; fill: none; }
svg .good { fill: var(--goodfill); } svg .fair { fill: var(--fairfill); }
svg .shadowmap { color: #2f6fb5; } svg .reference { color: var(--bad); }
figure { margin: 0; } img { width: 100%; height: auto; display: block; background: #888; }
.pair, .sheet { display: grid; gap: .8rem; margin: .6rem 0 1.4rem; }
.pair { grid-template-columns: repeat(auto-fill, minmax(240px, 1fr)); }
.sheet { grid-template-columns: repeat(auto-fill, minmax(200px, 1fr)); }
a { color: var(--link); } nav a { margin-right: 1rem; }
"""
KIND = {"reproduced": "reproduced", "partly": "partly", "refuted": "refuted"}
REFERENCES = ("raytraced", "multisample")


def verdict_html(verdict):
    return '<span class="verdict %s">%s</span>' % (KIND.get(verdict, "unmeasured"), escape(verdict))


def limits_text(limits):
    low, high = limits
    if abs(high) == float("inf"):
        return "at least %g" % low
    return "at most %g" % high if abs(low) == float("inf") else "%g to %g" % (low, high)


def figure(out, name, caption):
    path = "pictures/" + name
    if not os.path.exists(os.path.join(out, path)):
        return ""
    return '<figure><a href="%s"><img src="%s" alt="%s" loading="lazy"></a><figcaption>%s' \
           '</figcaption></figure>' % (path, path, escape(caption, True), escape(caption))


def values_html(entry):
    lines = []
    for scene in entry["scenes"]:
        text = "%.3g" % scene["median"]
        if scene["rounds"] > 1:
            text += ' <span class="soft">(%.3g to %.3g, %d rounds)</span>' % (
                scene["low"], scene["high"], scene["rounds"])
        lines.append('<span class="%s">%s</span> <span class="soft">%s</span>' % (
            scene["verdict"], text, escape(scene["scene"])))
    if entry["scenes"]:
        lines.append(svg.strip([(s["median"], s["low"], s["high"], s["verdict"])
                                for s in entry["scenes"]],
                               entry["limits"]["reproduced"], entry["limits"]["partly"]))
    return "<br>".join(lines) or '<span class="soft">%s</span>' % escape(
        "; ".join(entry.get("missing", ["no scene"])))


def pairs_html(out, paper):
    """One pair of pictures per claim that names one, on its first scene, each pair once."""
    parts, shown = [], set()
    for entry in paper["claims"]:
        for scene in entry["scenes"][:1] if entry["pair"] else ():
            names = (scene["group"],) + tuple(entry["pair"])
            if names in shown:
                continue
            shown.add(names)
            cells = [figure(out, "%s--%s.png" % (scene["group"], name),
                            "%s, %s" % (name, scene["scene"])) for name in entry["pair"]]
            cells += [figure(out, "%s--%s--difference.png" % (scene["group"], name),
                             "%s, visibility less the reference's: red too light, blue too dark"
                             % name) for name in entry["pair"] if name != "reference"]
            parts.append("<h4>%s</h4><div class=pair>%s</div>" % (escape(entry["text"]),
                                                                  "".join(cells)))
    return "".join(parts)


def paper_html(out, paper):
    rows = ["<tr><td>%s</td><td class=n>%s</td><td>%s<br><span class=soft>reproduced: %s; partly: "
            "%s</span></td><td>%s</td><td>%s</td></tr>" % (
                escape(entry["text"]), escape(entry["theirs"]), escape(entry["quantity"]),
                limits_text(entry["limits"]["reproduced"]), limits_text(entry["limits"]["partly"]),
                values_html(entry), verdict_html(entry["verdict"])) for entry in paper["claims"]]
    return ("<h2 id=%s>%s</h2><p class=soft>%s</p><div class=wide><table><tr><th>Claim<th class=n>"
            "Paper<th>What is compared<th>Ours: median (quartiles) by scene<th>Verdict</tr>%s"
            "</table></div>%s" % (paper["key"], escape(paper["title"]),
                                  escape(paper["conditions"]), "".join(rows),
                                  pairs_html(out, paper)))


def summary_html(papers):
    rows = []
    for paper in papers:
        counts = {}
        for entry in paper["claims"]:
            counts[entry["verdict"]] = counts.get(entry["verdict"], 0) + 1
        rows.append("<tr><td><a href='#%s'>%s</a></td><td>%s</td></tr>" % (
            paper["key"], escape(paper["title"]),
            ", ".join("%d %s" % (count, verdict_html(verdict))
                      for verdict, count in sorted(counts.items()))))
    return "<table><tr><th>Paper<th>Claims</tr>%s</table>" % "".join(rows)


def plot(rows, how):
    points = []
    for row in rows:
        if row["status"] == "ok" and row["rmse"] and row[how + "_ms"]:
            kind = "reference" if row["method"].split(" ")[0] in REFERENCES else "shadowmap"
            points.append((row[how + "_ms"], row["rmse"], row["method"], kind))
    return svg.scatter(points, "ms per image", "RMSE of visibility")


def cell(value, digits):
    return "<td class=n>%s</td>" % ("-" if value is None else "%.*f" % (digits, value))


def table_html(rows):
    out = ["<div class=wide><table><tr><th>Method<th class=n>RMSE<th class=n>penumbra<th class=n>"
           "SSIM<th class=n>FLIP<th class=n>ms, moving<th class=n>quartiles<th class=n>ms, kept"
           "<th class=n>map<th class=n>method<th class=n>shade</tr>"]
    for row in sorted(rows, key=lambda row: row["rmse"] or 9):
        if row["status"] != "ok":
            out.append("<tr><td>%s<td colspan=10 class=soft>%s</tr>" % (
                escape(row["method"]), escape(row["status"])))
            continue
        quartiles = row["moving_quartiles_ms"]
        out.append("<tr><td>%s</td>%s%s<td class='n soft'>%s</td>%s</tr>" % (
            escape(row["method"]),
            "".join(cell(row[key], digits) for key, _, digits in compare_methods.COLUMNS),
            cell(row["moving_ms"], 1),
            "-" if not quartiles else "one round" if row["moving_rounds"] == 1 else
            "%.1f to %.1f" % tuple(quartiles),
            "".join(cell(row[key], 1) for key in ("kept_ms", "shadow_ms", "technique_ms",
                                                  "shade_ms"))))
    return "".join(out) + "</table></div>"


def passes_html(rows):
    lines = []
    for row in rows:
        if row["passes"]:
            lines.append("<tr><td>%s<td>%s</tr>" % (escape(row["method"]), ", ".join(
                "%s %.2f" % (escape(p["name"]) + (" x%d" % p["count"] if p["count"] > 1 else ""),
                             p["ms"]) for p in row["passes"])))
    return "<details><summary>Every pass, ms (median)</summary><table>%s</table></details>" % \
        "".join(lines)


def scene_html(out, group):
    rows = compare_methods.table_rows(group)
    title = "%s, %d x %d, %s triangles" % (group["scene"], group["width"], group["height"],
                                           format(group["triangles"], ","))
    names = ["reference"] + [row["method"] for row in sorted(rows, key=lambda r: r["rmse"] or 9)]
    errors = {row["method"]: row["rmse"] for row in rows}
    sheet = "".join(figure(out, "%s--%s.png" % (group["group"], name), name if errors.get(name)
                           is None else "%s, RMSE %.4f" % (name, errors[name])) for name in names)
    differences = "".join(figure(out, "%s--%s--difference.png" % (group["group"], name), name)
                          for name in names[1:])
    return ("<h3 id=%s>%s</h3><p>Error against time, shadow inputs made anew for every image (blue: "
            "shadow maps and their filters, red: many samples of the light, drawn or traced):</p>%s"
            "<p>The same with shadow inputs kept (a still light and scene):</p>%s%s%s<details><summary>Contact "
            "sheet</summary><div class=sheet>%s</div></details><details><summary>Visibility less the reference's: "
            "red too light, blue too dark, full at 0.25</summary><div class=sheet>%s</div></details>"
            % (escape(group["group"], True), escape(title), plot(rows, "moving"),
               plot(rows, "kept"), table_html(rows), passes_html(rows), sheet, differences))


def methods_html(device):
    rows = ["<tr><td>%s<td>%s<td>%s<td>%s<td>%s</tr>" % (
        escape(m["name"]), escape(m["title"]), escape(m["citation"]),
        "yes" if m["textured"] else "no", escape(m["artefacts"])) for m in device["methods"]]
    return ("<h2 id=list>The methods</h2><div class=wide><table><tr><th>Name<th>Title<th>Source<th>"
            "Coloured lights<th>What goes wrong</tr>%s</table></div>" % "".join(rows))


def write(out, device, mode, papers, groups, methods):
    sizes = {"full": "", "quick": " A quick run: half the papers' picture size on each axis and at "
             "most 150,000 triangles; verdicts need a full one.",
             "tiny": " A run that only shows that everything works; its figures mean nothing."}
    parts = ["<!doctype html><html lang=en><meta charset=utf-8><meta name=viewport "
             "content='width=device-width'><title>Soft shadows, measured</title><style>", STYLE,
             "</style><h1>Soft shadows, measured</h1><p>Device: %s, OpenGL %s%s.%s</p>" % (
                 escape(device["device"]), escape(device["gl"]),
                 ", in software" if device["software"] else "", sizes[mode]),
             "<p>Times are compared only within a table: its variants took turns, image by image, "
             "and a ratio is taken within each round. Frame rates of the papers' graphics cards "
             "cannot be measured again; their ratios and orders can. On a software device passes "
             "cost what a processor needs for them: map passes weigh more than on a GPU, and so do "
             "verdicts that rest on them.</p>"]
    if device.get("load") is not None:
        parts.append("<p class=soft>%d processors; load average when the run began: %.1f.</p>" % (
            device["processors"], device["load"]))
    if papers:
        parts.append("<h2 id=claims>Claims on trial</h2><p>Limits were set before the first run, "
                     "from the papers' figures. A scene's verdict comes from its median; a claim is "
                     "reproduced when it is on every scene, refuted when on none it is at least "
                     "partly.</p>" + summary_html(papers))
        parts += [paper_html(out, paper) for paper in papers]
    if methods:
        parts.append("<h2 id=methods>Every method against ray tracing</h2><nav>%s</nav>" % "".join(
            "<a href='#%s'>%s</a>" % (escape(group["group"], True), escape(group["scene"]))
            for group in methods))
        parts += [scene_html(out, group) for group in methods]
    parts.append(methods_html(device))
    files = [name for name in ("claims.json", "claims.jsonl", "methods.json", "methods.jsonl",
                               "methods.md") if os.path.exists(os.path.join(out, name))]
    parts.append("<h2>Data</h2><p>%s</p></html>\n" % ", ".join(
        "<a href='%s'>%s</a>" % (name, name) for name in files))
    with open(os.path.join(out, "index.html"), "w", encoding="utf-8") as file:
        file.write("".join(parts))
