"""The race's table, in Markdown and as a page with the pictures and how costs grow."""
import html
import json
import os
import re
import statistics
import sys

sys.path.append(os.path.join(os.path.dirname(os.path.abspath(__file__)), "../claims"))
import svg  # noqa: E402

STYLE = """body{font:16px/1.45 system-ui,sans-serif;max-width:70rem;margin:2rem auto;padding:0 1rem}
table{border-collapse:collapse;margin:1rem 0}td,th{border:1px solid #ccc;padding:.3rem .6rem;
text-align:left;vertical-align:top}.met{background:#dff2df}.missed{background:#fae3df}
figure{display:inline-block;margin:.4rem}figcaption{font-size:.9rem}img{width:33rem;max-width:100%}
svg{width:100%;max-width:52rem}.grid{stroke:#ddd;fill:none}.lead{stroke:#aaa;fill:none}
.tick,text{font-size:11px}.line{fill:none;stroke:#36c;stroke-opacity:.55}circle{fill:#36c}"""


def against(times, other, what="ms"):
    """Ratios ours / other per round."""
    return [a / b for a, b in zip(times["ours"][what], times[other][what]) if b]


def ratio_text(values):
    """Median, and from which to which."""
    if not values:
        return "-"
    middle = statistics.median(values)
    if middle < 0.02:
        return "1 / %.0f (1 / %.0f to 1 / %.0f)" % (1 / middle, 1 / max(values), 1 / min(values))
    return "%.2f (%.2f to %.2f)" % (middle, min(values), max(values))


def goal_text(goal):
    return "-" if goal is None else "1 / %.0f" % (1 / goal) if goal < 0.02 else "%.2f" % goal


def entry(what, by, ratio, processors, ours, theirs, goal, met):
    return {"what": what, "by": by, "ratio": ratio, "processors": processors, "ours": ours,
            "theirs": theirs, "goal": goal, "met": met}


def entries(row):
    """Lines of the table."""
    if "times" in row:
        times = row["times"]
        for other in times:
            if other == "ours":
                continue
            values = against(times, other)
            goal = row.get("goal")
            yield entry(row["title"], other, ratio_text(values),
                        ratio_text(against(times, other, "processor_ms")) if other != "VTK" else "-",
                        "%.0f ms" % statistics.median(times["ours"]["ms"]),
                        "%.0f ms" % statistics.median(times[other]["ms"]), goal_text(goal),
                        None if goal is None else statistics.median(values) <= goal)
    elif "starts" in row:
        starts = {name: statistics.median(values) / 1e3 for name, values in row["starts"].items()}
        yield entry(row["title"], "three.js, first picture",
                    "%.2f" % (starts["ready"] / starts["three.js"]), "-", "%.2f s" % starts["ready"],
                    "%.2f s" % starts["three.js"], "0.5 s", starts["ready"] <= 0.5)
        yield entry("start to the first picture over HTTP, full shader cache",
                    "three.js, first picture", "%.2f" % (starts["ours"] / starts["three.js"]), "-",
                    "%.2f s" % starts["ours"], "%.2f s" % starts["three.js"], "0.8 s",
                    starts["ours"] <= 0.8)
        yield entry("start to ready, empty shader cache", "-", "-", "-", "%.1f s" % row["empty_s"][0],
                    "-", "3 s", row["empty_s"][0] <= 3)
    elif "idle_mib" in row:
        yield entry("memory of an idle worker", "three.js, all processes",
                    "%.2f" % (row["idle_mib"] / row["three_mib"]), "-",
                    "%.0f MiB" % row["idle_mib"], "%.0f MiB" % row["three_mib"], "120 MB",
                    row["idle_mib"] * 1.048576 <= 120)
        yield entry("peak of a busy worker, all methods at `--gpu-memory` 1G", "-", "-", "-",
                    "%.0f MiB" % row["busy_mib"], "-", "1 GiB + 150 MB",
                    row["busy_mib"] <= 1024 + 150 / 1.048576)


def lines(row):
    """What is printed as soon as a row is done."""
    for e in entries(row):
        yield "%s: %s of %s (processors %s); %s against %s; goal %s" % (
            e["what"], e["ratio"], e["by"], e["processors"], e["ours"], e["theirs"], e["goal"])
    if "stages" in row:
        yield "passes: " + passes_text(row)
    if "errors" in row:
        yield "errors: " + errors_text(row)


def passes_text(row):
    passes = sorted(row["passes"].items(), key=lambda item: -item[1])
    return ", ".join("%s %.1f" % p for p in passes if p[1] >= 0.05) + ", encode %.1f" % (
        row["stages"]["encode"])


def errors_text(row):
    return ", ".join("%s %.4f" % pair for pair in row["errors"].items())


def markdown(rows):
    found = ["| work | ours / theirs | in processor time | ours | theirs | goal |",
             "| --- | --- | --- | --- | --- | --- |"]
    for row in rows:
        for e in entries(row):
            by = "" if e["by"] in ("three.js", "-") else " (%s)" % e["by"]
            met = {True: ", met", False: ", missed", None: ""}[e["met"]]
            found.append("| %s | %s | %s | %s | %s%s | %s%s |" % (
                e["what"], e["ratio"], e["processors"], e["ours"], e["theirs"], by, e["goal"], met))
    found += ["", "Milliseconds of our passes, in the same row:", "", "| work | passes |",
              "| --- | --- |"]
    found += ["| %s | %s |" % (row["title"], passes_text(row)) for row in rows if "stages" in row]
    for row in rows:
        if "errors" in row:
            found += ["", "Errors in the crop %s: %s." % (tuple(row["box"]), errors_text(row))]
    return "\n".join(found) + "\n"


def code(text):
    return re.sub(r"`([^`]*)`", r"<code>\1</code>", html.escape(text))


def growth_html(out):
    """Plots of what penumbra-bench measured, when growth.json is there."""
    path = os.path.join(out, "growth.json")
    if not os.path.exists(path):
        return ""
    with open(path, encoding="utf-8") as file:
        measured = json.load(file)
    found = ["<h2>How costs grow</h2><p>%s. One axis at a time leaves the base; exponent 1: "
             "proportional (over the resolution: to the pixels).</p>" % code(measured["device"])]
    axes = {}
    for item in measured["growth"]:
        axes.setdefault(item["axis"], {})[item["method"]] = item["exponent"]
    for axis, exponents in axes.items():
        curves = {}
        for sample in measured["samples"]:
            base = next(s for s in measured["samples"] if s["method"] == sample["method"])
            if sample is base or sample[axis] != base[axis]:
                curves.setdefault(sample["method"], []).append((sample[axis], sample["median_ms"]))
        curves = {name: sorted(points) for name, points in curves.items() if name in exponents}
        found.append("<h3>%s</h3>%s<p>%s</p>" % (
            html.escape(axis.replace("_", " ")), svg.curves(curves, axis.replace("_", " "), "ms"),
            ", ".join("%s %.2f" % item for item in sorted(exponents.items(), key=lambda i: -i[1]))))
    return "".join(found)


def page(out, rows):
    body = ["<h1>The race</h1>"]
    timed = next((row for row in rows if "about" in row), None)
    if timed:
        body.append("<p>%s, 800 x 600, request to the bytes of a PNG. Ours: %s. three.js: %s. Ratios "
                    "are medians of alternating rounds in one run, with the least and the most.</p>" % (
                        code(timed["scene_title"]), code(timed["about"]["ours"]),
                        code(timed["about"]["three.js"])))
    body.append("<table><tr><th>work<th>ours / theirs<th>in processor time<th>ours<th>theirs<th>goal"
                "</tr>")
    for row in rows:
        for e in entries(row):
            body.append('<tr><td>%s<td>%s<td>%s<td>%s<td>%s<td class="%s">%s</tr>' % (
                code(e["what"]), e["ratio"], e["processors"], e["ours"],
                code("%s %s" % (e["theirs"], "" if e["by"] == "three.js" else e["by"])),
                {True: "met", False: "missed", None: ""}[e["met"]], e["goal"]))
    body.append("</table><h2>Where our milliseconds go</h2><table>")
    body += ["<tr><td>%s<td>%s</tr>" % (code(row["title"]), html.escape(passes_text(row)))
             for row in rows if "stages" in row]
    body.append("</table>")
    for row in rows:
        if "errors" in row:
            body.append("<p>Errors in the crop %s (root mean square of sRGB values in [0, 1], each "
                        "against the many samples of its own): %s.</p>" % (
                            tuple(row["box"]), html.escape(errors_text(row))))
    body.append("<h2>Pictures</h2>")
    for row in rows:
        body += ['<figure><img src="%s" alt="%s"><figcaption>%s</figcaption></figure>' % (
            name, html.escape(text, True), html.escape(text)) for name, text in row.get("pictures", ())]
    body.append("<h2>What was checked of the experiments</h2><ul>")
    body += ["<li>%s%s" % ("" if c["holds"] else "<strong>does not hold:</strong> ", code(c["what"]))
             for row in rows for c in row["checks"]]
    body.append("</ul>" + growth_html(out))
    return ('<!DOCTYPE html><html lang="en"><meta charset="utf-8"><title>The race</title>'
            "<style>%s</style>%s</html>\n" % (STYLE, "\n".join(body)))


def write(out, rows):
    with open(os.path.join(out, "table.md"), "w", encoding="utf-8") as file:
        file.write(markdown(rows))
    with open(os.path.join(out, "index.html"), "w", encoding="utf-8") as file:
        file.write(page(out, rows))
