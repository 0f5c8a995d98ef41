#!/usr/bin/env python3
"""Compares excluded surfaces of molecules with those of PyMOL: error of volume and area, CPU seconds, peak memory.

    molecules.py LEVELSMITH [CSV]

Molecules are those of the Debian packages rdkit-data, apbs-data and pymol-data. The reference is our surface with voxels
of 0.1 Å. Cavities and small parts are left out for PyMOL, since it draws no small cavities. Exits 1 unless our volume and
area are within 0.5 %, and our time is at most that of PyMOL at a tenth of its error of the volume.
"""
import csv
import json
import os
import subprocess
import sys
import tempfile
import pathlib

FOLDERS = {"rdkit": "/usr/share/RDKit/Contrib/CalcLigRMSD/data", "apbs": "/usr/share/apbs/examples",
           "pymol": "/usr/share/pymol"}
MOLECULES = ("rdkit/6c83.pdb rdkit/5dt0.pdb rdkit/aurka_protein_2c6e.pdb rdkit/5dpv.pdb apbs/actin-dimer/UHBD/prot3.pdb "
             "pymol/data/demo/1tii.pdb pymol/data/demo/il2.pdb pymol/data/tut/1hpv.pdb "
             "apbs/protein-rna/PDB/model_outNB.pdb pymol/data/demo/pept.pdb").split()
VOXEL, FINE = 0.25, 0.1
PYMOL = """
import time
from pymol import cmd
cmd.load({path!r}, 'm')
cmd.remove('resn HOH+WAT')
cmd.remove('not alt ""+A')
cmd.hide('everything')
cmd.flag('ignore', 'all', 'clear')
cmd.set('surface_mode', 1)
cmd.set('solvent_radius', 1.4)
cmd.set('surface_quality', 1)
start = time.process_time()
cmd.show('surface', 'm')
cmd.rebuild()
cmd.refresh()
seconds = time.process_time() - start
cmd.save({mesh!r})
print('RESULT', seconds, cmd.count_atoms('m'))
"""


def run(command, **options):
    """Output, CPU seconds and peak memory in MB of a command."""
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True, **options)
    with process.stdout:
        text = process.stdout.read()
    _, status, usage = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode:
        sys.exit(f"{' '.join(command)}: exit code {process.returncode}")
    return text, usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 1000


def measured(levelsmith, *chain, closed=False):
    """Volume and area of a solid; closed: without cavities and small parts."""
    filters = ["!", "fill-cavities", "!", "keep", "--largest", "1"] if closed else []
    figures = json.loads(run([levelsmith, "-q", *chain, *filters, "!", "measure", "--json"])[0])
    return figures["volume"], figures["area"]


def main(levelsmith, table):
    rows, missed = [], 0
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        for molecule in MOLECULES:
            package, _, rest = molecule.partition("/")
            path = str(pathlib.Path(FOLDERS[package], rest))
            atoms = json.loads(run([levelsmith, "-q", "read", path, "!", "info", "--json"])[0])["atoms"]
            chain = ["read", path, "!", "molecule-surface"]
            fine = str(folder / "fine.vdb")
            run([levelsmith, "-q", *chain, "--voxel", str(FINE), "!", "write", fine])
            volume, area = measured(levelsmith, "read", fine)
            closed_volume, closed_area = measured(levelsmith, "read", fine, closed=True)
            ours = measured(levelsmith, *chain, "--voxel", str(VOXEL))
            _, seconds, megabytes = run([levelsmith, "-q", *chain, "--voxel", str(VOXEL), "!", "mesh", "!", "write",
                                         str(folder / "ours.ply")])
            script, mesh = folder / "pymol.py", str(folder / "pymol.obj")
            script.write_text(PYMOL.format(path=path, mesh=mesh), encoding="utf-8")
            environment = dict(os.environ, PATH="/usr/bin:/bin")
            told, _, their_megabytes = run(["pymol", "-cq", str(script)], env=environment)
            _, theirs, count = next(line for line in told.splitlines() if line.startswith("RESULT")).split()
            peer = measured(levelsmith, "read", mesh, "!", "level-set", "--voxel", "0.2", "--accept-sign",
                            closed=True)
            row = {"molecule": pathlib.Path(rest).stem, "atoms": atoms, "pymol_atoms": int(count),
                   "volume_error": abs(ours[0] / volume - 1), "area_error": abs(ours[1] / area - 1), "cpu_s": seconds, "mb": megabytes,
                   "pymol_volume_error": abs(peer[0] / closed_volume - 1), "pymol_area_error": abs(peer[1] / closed_area - 1),
                   "pymol_cpu_s": float(theirs), "pymol_mb": their_megabytes}
            rows.append(row)
            print(", ".join(f"{key} {value:.3g}" if isinstance(value, float) else f"{key} {value}"
                            for key, value in row.items()), flush=True)
            if max(row["volume_error"], row["area_error"]) > 0.005:
                print(f"  missed: error of volume or area above 0.5 % at voxels of {VOXEL}")
                missed += 1
            if seconds > row["pymol_cpu_s"] or row["volume_error"] > 0.1 * row["pymol_volume_error"]:
                print("  missed: the time of PyMOL, or a tenth of its error")
                missed += 1
    if table:
        with open(table, "w", newline="", encoding="utf-8") as file:
            writer = csv.DictWriter(file, rows[0].keys())
            writer.writeheader()
            writer.writerows(rows)
    return 1 if missed else 0


if __name__ == "__main__":
    if len(sys.argv) not in (2, 3):
        sys.exit(__doc__)
    sys.exit(main(sys.argv[1], sys.argv[2] if len(sys.argv) == 3 else None))
