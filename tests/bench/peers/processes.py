"""What a program and all that it started hold and use, from /proc."""
import os
import re

TICK_MS = 1e3 / os.sysconf("SC_CLK_TCK")


def fields(pid):
    """State, parent and all behind them of /proc/PID/stat; None when it is gone."""
    try:
        with open("/proc/%d/stat" % pid, encoding="utf-8", errors="replace") as file:
            return file.read().rsplit(")", 1)[1].split()
    except OSError:
        return None


def tree(root):
    """`root` and all below it."""
    children = {}
    for name in filter(str.isdigit, os.listdir("/proc")):
        found = fields(int(name))
        if found:
            children.setdefault(int(found[1]), []).append(int(name))
    all_of_it, at = [root], 0
    while at < len(all_of_it):
        all_of_it += children.get(all_of_it[at], [])
        at += 1
    return all_of_it


def command(pid):
    try:
        with open("/proc/%d/cmdline" % pid, encoding="utf-8", errors="replace") as file:
            return file.read().replace("\0", " ")
    except OSError:
        return ""


def processor_ms(pids):
    """Processor time so far, of ended children that were waited for too."""
    found = filter(None, map(fields, pids))
    return TICK_MS * sum(int(value) for stat in found for value in stat[11:15])


def status_mib(pid, field):
    """VmRSS, VmHWM."""
    with open("/proc/%d/status" % pid, encoding="utf-8") as file:
        return int(re.search(field + r":\s*(\d+) kB", file.read())[1]) / 1024


def held_mib(pids):
    """Memory that is these processes' own, and their share of what they share (PSS)."""
    total = 0
    for pid in pids:
        try:
            with open("/proc/%d/smaps_rollup" % pid, encoding="utf-8") as file:
                total += int(re.search(r"^Pss:\s*(\d+) kB", file.read(), re.M)[1])
        except (OSError, TypeError):
            pass
    return total / 1024
