#!/usr/bin/env python3
"""Compares the time and memory of actions on solids of several million voxels with the estimate of --explain.

usage: step_costs.py LEVELSMITH [ACTION ...]
Uses one thread. Prints CPU seconds, the peak memory of the process less the peak of the previous action, and the
ratios of estimate to measurement. Costs are rough: their ratios should lie between 0.4 and 2.5. Otherwise the
figures of the action (Operator::cost) must be measured again. Exits 1 if a ratio is outside this range.
"""

import json
import os
import re
import subprocess
import sys
import tempfile

TORUS = "torus --radius 2 --tube 0.6 --voxel {v} --as t ! "
BOX = "box --size 3,2,2 --voxel {v} --as b ! "
FACETED = "sphere --radius 1.5 --voxel 0.15 ! mesh ! level-set --voxel {v} ! "
CHAINS = {
    "sphere": "sphere --radius 2 --voxel {v}",
    "box": "box --size 3,2,2 --voxel {v}",
    "cylinder": "cylinder --radius 1 --height 3 --voxel {v}",
    "level-set": TORUS + "mesh ! level-set --voxel {v}",
    "level-set, coarse": TORUS + "mesh ! level-set --voxel {w}",
    "mesh": TORUS + "mesh",
    "mesh --sharp": TORUS + "mesh --sharp",
    "union": TORUS + BOX + "union",
    "difference": TORUS + BOX + "difference",
    "offset": TORUS + "offset 0.05",
    "offset, far": TORUS + "offset 0.3",
    "offset --by": TORUS + "offset --by 0.05*x",
    "offset, faceted": FACETED + "offset 0.05",
    "open": TORUS + "open 0.1",
    "close": TORUS + "close 0.1",
    "shell": TORUS + "shell --thickness 0.15",
    "keep": TORUS + "keep --largest 1",
    "fill-cavities": TORUS + "fill-cavities",
    "smooth": TORUS + "smooth --sigma 1vx",
    "smooth, wide": TORUS + "smooth --sigma 3vx",
    "smooth, median": TORUS + "smooth --kind median --sigma 2vx",
    "smooth, taubin": TORUS + "smooth --kind taubin --sigma 1vx",
    "smooth, faceted": FACETED + "smooth --sigma 2vx",
    "reinitialize": TORUS + "reinitialize",
    "rebuild-band": TORUS + "rebuild-band --half-width 10",
    "fast-marching": TORUS + "fast-marching --to 8vx",
    "fast-sweeping": TORUS + "fast-sweeping --to 8vx",
    "closest-point": TORUS + "closest-point",
    "transform --bake": TORUS + "transform --rotate 30 --bake",
    "resample": TORUS + "resample --voxel {h}",
    "clip": TORUS + "clip --plane 0,0,0_1,0,0",
    "curvature-flow": TORUS + "curvature-flow --time 0.01",
    "measure": TORUS + "measure",
    "measure, a mesh": TORUS + "mesh ! measure",
    "check": TORUS + "check",
    "compare": TORUS + BOX + "compare",
}


def words(chain, voxel):
    text = chain.format(v=voxel, h=voxel / 2, w=voxel * 2)
    return [word.replace("_", " ") for word in text.split()]


def said(command, chain):
    """Seconds and bytes of the last action, as estimated by --explain."""
    told = subprocess.run([command, "--explain", *chain], capture_output=True, text=True, check=True).stdout
    row = told.splitlines()[-2]
    seconds = re.search(r"; ([0-9.e+-]+) s", row)
    worked = re.search(r"working memory ([0-9.e+-]+) MB", row)
    made = re.search(r", ([0-9.e+-]+) MB", row.split("working memory")[0])
    values = sum(float(found.group(1)) for found in (worked, made) if found)
    return float(seconds.group(1)) if seconds else None, 1e6 * values


def taken(command, chain, folder):
    report = os.path.join(folder, "r.json")
    subprocess.run([command, "--report", report, "--threads", "1", *chain], capture_output=True, check=True)
    with open(report) as file:
        steps = json.load(file)["steps"]
    before = steps[-2]["peak_bytes"] if len(steps) > 1 else 44e6
    return steps[-1]["cpu_s"], steps[-1]["peak_bytes"] - before


def main():
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    command, chosen, isFar = os.path.abspath(sys.argv[1]), sys.argv[2:], False
    print(f"{'action':18} {'voxel':>6} {'CPU s':>7} {'said':>7} {'ratio':>6} {'MB':>6} {'said':>6} {'ratio':>6}")
    with tempfile.TemporaryDirectory() as folder:
        for name, chain in CHAINS.items():
            if chosen and name.split(",")[0].split()[0] not in chosen:
                continue
            for voxel in (0.03, 0.015):
                chain_words = words(chain, voxel)
                seconds, used = taken(command, chain_words, folder)
                guess, guessed = said(command, chain_words)
                ratio = guess / seconds if guess else float("nan")
                isFar |= seconds > 0.2 and not 0.4 < ratio < 2.5
                share = guessed / used if used > 5e6 else float("nan")
                isFar |= used > 40e6 and not 0.4 < share < 2.5
                print(
                    f"{name:18} {voxel:6} {seconds:7.2f} {guess or 0:7.2f} {ratio:6.2f}"
                    f" {used / 1e6:6.0f} {guessed / 1e6:6.0f} {share:6.2f}",
                    flush=True,
                )
    sys.exit(1 if isFar else 0)


if __name__ == "__main__":
    main()
