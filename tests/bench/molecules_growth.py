#!/usr/bin/env python3
"""Measures reading and surfaces of synthetic molecules of 10^4 to 10^6 atoms: CPU seconds and peak memory.

    molecules_growth.py LEVELSMITH [CSV]

The molecule is a lattice of chains of carbon, nitrogen and oxygen atoms, as PDB with serial numbers in base 36, as PDB with
stars, and as mmCIF. Exits 1 unless the time for each atom grows by at most half from 10^5 to 10^6 atoms, and the memory
stays within BYTES for each atom. Surfaces have --max-memory 8G. A refusal has exit code 4, and its cost is printed.
"""
import csv
import json
import os
import pathlib
import subprocess
import sys
import tempfile

COUNTS = (10_000, 100_000, 1_000_000)
BYTES = {"read": 2000, "vdw": 12000, "accessible": 24000}
DIGITS = "0123456789ABCDEFGHIJKLMNOPQRSTUVWXYZ"


def hybrid36(number, width):
    """Number as PDB files have it where decimal digits do not suffice."""
    if number < 10 ** width:
        return f"{number:>{width}}"
    number += 10 * 36 ** (width - 1) - 10 ** width
    text = ""
    while number:
        number, digit = divmod(number, 36)
        text = DIGITS[digit] + text
    return text


def atoms(count):
    """Name, element, residue and position of each atom: zigzag chains, 4.6 Å apart."""
    edge = max(1, round((count / 3.6) ** (1 / 3)))
    for n in range(count):
        step, row = n % (4 * edge), n // (4 * edge)
        element = "CNCO"[n % 4]
        yield n, element, n // 8, (1.27 * step, 4.6 * (row % edge) + (0.86 if n % 2 else 0), 4.6 * (row // edge))


def write_pdb(path, count, has_stars=False):
    with open(path, "w", encoding="ascii") as file:
        for n, element, residue, (x, y, z) in atoms(count):
            serial = "*****" if has_stars and n >= 99_999 else hybrid36(n + 1, 5)
            file.write(f"ATOM  {serial}  {element:<3} UNK A{hybrid36(residue % 400_000, 4)}    {x:8.3f}{y:8.3f}{z:8.3f}"
                       f"{1:6.2f}{n % 100:6.2f}          {element:>2}\n")
        file.write("END\n")


def write_cif(path, count):
    names = "type_symbol label_atom_id label_comp_id auth_asym_id auth_seq_id Cartn_x Cartn_y Cartn_z B_iso_or_equiv".split()
    with open(path, "w", encoding="ascii") as file:
        file.write("data_x\nloop_\n" + "".join(f"_atom_site.{name}\n" for name in names))
        for n, element, residue, (x, y, z) in atoms(count):
            file.write(f"{element} {element} UNK A {residue} {x:.3f} {y:.3f} {z:.3f} {n % 100}\n")


LIMIT, REFUSED = "8G", 4


def run(levelsmith, *chain, may_refuse=False):
    """Output, CPU seconds and peak memory in bytes of a chain. The output of a refusal for memory is None."""
    process = subprocess.Popen([levelsmith, "-q", *chain], stdout=subprocess.PIPE, text=True)
    text = process.stdout.read()
    _, status, usage = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    if may_refuse and process.returncode == REFUSED:
        return None, usage.ru_utime + usage.ru_stime, usage.ru_maxrss * 1024
    if process.returncode:
        sys.exit(f"{' '.join(chain)}: exit code {process.returncode}")
    return text, usage.ru_utime + usage.ru_stime, usage.ru_maxrss * 1024


def main(levelsmith, table):
    rows, missed = [], 0
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        for count in COUNTS:
            pdb, stars, cif = (str(folder / f"{kind}.{end}") for kind, end in
                               (("a", "pdb"), ("stars", "pdb"), ("a", "cif")))
            write_pdb(pdb, count)
            write_pdb(stars, count, has_stars=True)
            write_cif(cif, count)
            row = {"atoms": count}
            for key, path in (("pdb", pdb), ("stars", stars), ("cif", cif)):
                text, seconds, memory = run(levelsmith, "read", path, "!", "info", "--json")
                if json.loads(text)["atoms"] != count:
                    sys.exit(f"{path}: {json.loads(text)['atoms']} atoms instead of {count}")
                row |= {f"{key}_s": seconds, f"{key}_mb": memory / 1e6}
            for kind in ("vdw", "accessible", "excluded"):
                text, seconds, memory = run(levelsmith, "--max-memory", LIMIT, "read", pdb, "!", "molecule-surface", "--kind",
                                            kind, "--voxel", "1", may_refuse=True)
                row |= {f"{kind}_s": seconds, f"{kind}_mb": memory / 1e6}
                if text is None:
                    print(f"  missed: {kind} of {count} atoms is refused with {LIMIT}")
                    missed += 1
            _, seconds, memory = run(levelsmith, "read", pdb, "!", "molecule-model", "--style", "balls", "--ball-scale",
                                     "0.6", "--voxel", "0.8")
            row |= {"balls_s": seconds, "balls_mb": memory / 1e6}
            rows.append(row)
            print(", ".join(f"{key} {value:.3g}" for key, value in row.items()), flush=True)
            for key, limit in (("pdb", BYTES["read"]), ("cif", BYTES["read"]), ("vdw", BYTES["vdw"]),
                               ("accessible", BYTES["accessible"])):
                if count >= 100_000 and row[f"{key}_mb"] * 1e6 > limit * count:
                    print(f"  missed: {key} takes over {limit} bytes for each atom")
                    missed += 1
    for key in ("pdb_s", "cif_s", "vdw_s", "accessible_s"):
        if rows[2][key] > 15 * rows[1][key]:
            print(f"missed: {key} grows by a factor of {rows[2][key] / rows[1][key]:.3g} from 10^5 to 10^6 atoms")
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
