"""Writes a PDB of a carbon nanotube with balls of 60 carbon atoms inside (a peapod), for docs/gallery.sh."""

import itertools
import math

BOND = 1.42  # Å


def tube(n, rows):
    """An armchair tube (n, n) along x: rings of 2n atoms in pairs."""
    radius = 3 * n * BOND / (2 * math.pi)
    for row in range(rows):
        x = row * BOND * math.sqrt(3) / 2
        for k in range(n):
            for turn in (0, 1) if row % 2 == 0 else (1.5, 2.5):
                angle = 2 * math.pi / (3 * n) * (3 * k + turn)
                yield x, radius * math.cos(angle), radius * math.sin(angle)


def ball():
    """The 60 atoms of a truncated icosahedron with edges of 1.43 Å."""
    golden = (1 + math.sqrt(5)) / 2
    points = set()
    for base in ((0, 1, 3 * golden), (1, 2 + golden, 2 * golden), (golden, 2, 2 * golden + 1)):
        for signs in itertools.product((1, -1), repeat=3):
            p = [s * c for s, c in zip(signs, base)]
            for turn in range(3):
                points.add(tuple(round(c * 1.43 / 2, 4) for c in p[turn:] + p[:turn]))
    return sorted(p for p in points)


def main():
    rows, spacing = 38, 10.0
    atoms = []
    for x, y, z in tube(10, rows):
        x -= rows * BOND * math.sqrt(3) / 4
        if x < -14 or math.sin(0.9 * (math.atan2(z, y) - 0.9) + 0.035 * x) < 0.1 + 0.02 * x:  # the wall is open in front
            atoms.append((x, y, z, "A"))
    for k in range(-2, 3):
        turn = 0.7 * k
        for x, y, z in ball():
            y, z = y * math.cos(turn) - z * math.sin(turn), y * math.sin(turn) + z * math.cos(turn)
            atoms.append((x + spacing * k, y, z, "B"))
    for number, (x, y, z, chain) in enumerate(atoms, 1):
        print(f"HETATM{number % 100000:5d}  C   {'TUB' if chain == 'A' else 'C60'} {chain}   1    "
              f"{x:8.3f}{y:8.3f}{z:8.3f}  1.00  0.00           C")
    print("END")


main()
