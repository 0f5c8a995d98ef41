// The grid points about a cell, wherever they are held. In the words and the space of roots.glsl.

// The six grid points on each axis from cell − 2 on, which lie in one block or in two.
struct Window {
  Whole base[8];     // of the blocks, by bits x, y, z: where their first values are
  Whole strides[8];  // and how far apart others
  Bool farX[6], farY[6], farZ[6];
  Whole stepX[6], stepY[6], stepZ[6];  // within the block
};

Window windowAt(Bool asked, Whole cellX, Whole cellY, Whole cellZ) {
  Window w;
  Whole x = cellX - 2;
  Whole y = cellY - 2;
  Whole z = cellZ - 2;
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

// Numbers of the values at (i, j, 0) and on, as long as they are in the near blocks or in the far.
Whole firstAt(IN(Window) w, int i, int j, int far) {
  Whole base = select(w.farY[j], select(w.farX[i], w.base[6 + far], w.base[2 + far]),
                      select(w.farX[i], w.base[4 + far], w.base[far]));
  Whole strides = select(w.farY[j], select(w.farX[i], w.strides[6 + far], w.strides[2 + far]),
                         select(w.farX[i], w.strides[4 + far], w.strides[far]));
  return base + w.stepX[i] * (strides >> kStrideShift) + w.stepY[j] * (strides & ((1 << kStrideShift) - 1));
}
