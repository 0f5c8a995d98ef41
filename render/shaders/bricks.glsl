// Look-up of cells and values in the tables of a BrickPool (render/bricks/brick_pool.h). Types and
// coordinates are those of roots.glsl: one lane for each ray, table space in voxels. Parameters
// named `walking` or `asked` select the active lanes.

struct Spot {
  Bool crosses;  // the surface may cross the cell
  Int size;    // edge, in cells, of an aligned cube around the cell in which the surface crosses no other cell
  Int brick;   // number of the brick that stores the cell's values; valid if `crosses`
};

Spot spotAt(Bool walking, Int x, Int y, Int z) {
  Int page = select(walking, ((x >> kPageShift) * pagesY + (y >> kPageShift)) * pagesZ + (z >> kPageShift), integer(0));
  Int entry = loadPage(page);
  Bool full = AND(walking, entry >= 0);
  Int slot = select(full, entry + (((x >> 3) & 7) << 6 | ((y >> 3) & 7) << 3 | ((z >> 3) & 7)), integer(0));
  Int held = loadEntry(slot);
  entry = select(full, held, entry);
  Bool isBrick = AND(full, entry >= 0);
  Int cell = (x & 7) << 6 | (y & 7) << 3 | (z & 7);
  Int word = loadMask(select(isBrick, (entry << 4) + (cell >> 5), integer(0)));
  Spot spot;
  spot.crosses = AND(isBrick, ((word >> (cell & 31)) & 1) != 0);
  spot.size = select(isBrick, integer(1), integer(0) - entry);
  spot.brick = entry;
  return spot;
}

// Values at the corners of a cell. Corner (x, y, z), each 0 or 1, has the number 4x + 2y + z.
struct CellValues {
  Real f0, f1, f2, f3, f4, f5, f6, f7;
};

CellValues cellValues(Bool asked, Int brick, Int x, Int y, Int z) {
  Int corner = ((x & 7) * kBrickEdge + (y & 7)) * kBrickEdge + (z & 7);
  Int first = select(asked, brick * kBrickValues + corner, integer(0));
  CellValues f;
  f.f0 = loadValue(first);
  f.f1 = loadValue(first + 1);
  f.f2 = loadValue(first + kBrickEdge);
  f.f3 = loadValue(first + (kBrickEdge + 1));
  f.f4 = loadValue(first + kBrickEdge * kBrickEdge);
  f.f5 = loadValue(first + (kBrickEdge * kBrickEdge + 1));
  f.f6 = loadValue(first + (kBrickEdge * kBrickEdge + kBrickEdge));
  f.f7 = loadValue(first + (kBrickEdge * kBrickEdge + kBrickEdge + 1));
  return f;
}

// Returns the index, in the pool's list of values, of the first value of the block that contains
// the grid point (x, y, z). `strides` receives the packed strides of the block's values; 0 where
// they are all equal.
Int blockOf(Bool asked, Int x, Int y, Int z, INOUT(Int) strides) {
  Int page = loadPage(select(asked, ((x >> kPageShift) * pagesY + (y >> kPageShift)) * pagesZ + (z >> kPageShift), integer(0)));
  Bool full = AND(asked, page >= 0);
  Int slot = select(full, page + (((x >> 3) & 7) << 6 | ((y >> 3) & 7) << 3 | ((z >> 3) & 7)), integer(0));
  Int heldStrides = loadEntry(slot + kStridesOfEntry);
  Int first = loadEntry(slot + kFirstOfEntry);
  strides = select(full, heldStrides, integer(0));
  return select(full, first, integer(0));
}
