// Access to the 6³ grid points around a cell, which lie in up to eight blocks. Types and
// coordinates are those of roots.glsl.

// Six grid points on each axis, from two points before the lowest corner of the cell on. Along an
// axis they lie in one block, or in a near block and a far block.
struct Window {
  Int base[8];     // index of the first value of each block in the list of values; bits 4, 2, 1 of n in base[n]: far along x, y, z
  Int strides[8];  // packed strides of the block's values
  Bool farX[6], farY[6], farZ[6];    // the point lies in the far block of the axis
  Int stepX[6], stepY[6], stepZ[6];  // coordinate of the point within its block, 0 … 7
};

Window windowAt(Bool asked, Int cellX, Int cellY, Int cellZ) {
  Window w;
  Int x = cellX - 2;
  Int y = cellY - 2;
  Int z = cellZ - 2;
  for (int i = 0; i < 6; ++i) {
    w.farX[i] = (x & 7) + i > 7;
    w.farY[i] = (y & 7) + i > 7;
    w.farZ[i] = (z & 7) + i > 7;
    w.stepX[i] = (x + i) & 7;
    w.stepY[i] = (y + i) & 7;
    w.stepZ[i] = (z + i) & 7;
  }
  for (int i = 0; i < 8; ++i)
    w.base[i] = blockOf(asked, x + 5 * (i >> 2), y + 5 * ((i >> 1) & 1), z + 5 * (i & 1), w.strides[i]);
  return w;
}

// Index, in the list of values, of the first value along z of column (i, j) in its block: in the
// far block along z if `far` is 1, else in the near block. Adding stepZ[k] gives the index of value
// (i, j, k).
Int firstAt(IN(Window) w, int i, int j, int far) {
  Int base = select(w.farY[j], select(w.farX[i], w.base[6 + far], w.base[2 + far]),
                      select(w.farX[i], w.base[4 + far], w.base[far]));
  Int strides = select(w.farY[j], select(w.farX[i], w.strides[6 + far], w.strides[2 + far]),
                         select(w.farX[i], w.strides[4 + far], w.strides[far]));
  return base + w.stepX[i] * (strides >> kStrideShift) + w.stepY[j] * (strides & ((1 << kStrideShift) - 1));
}
