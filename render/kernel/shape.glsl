// What a surface looks like at a hit: gradient and Hessian of the tricubic B-spline with the
// coefficients f − ∇²f/6 [Sigg05], and the gradient of the trilinear interpolant. Where the grid holds
// the coefficients of the spline that rays meet, it is that one. In the words and the space of
// roots.glsl.

CONST_FLOAT kSixth = 0.16666666667f;
CONST_FLOAT kEighth = 0.125f;

// Of the four points from cell − 1 on, on one axis: the uniform cubic B-spline and its derivatives.
struct Weights {
  Real value[4], slope[4], bend[4];
};

Weights splineWeights(Real a) {
  VAR b = 1.0f - a;
  VAR aa = a * a;
  VAR bb = b * b;
  VAR v0 = bb * b * kSixth;
  VAR v1 = (3.0f * aa * a - 6.0f * aa + 4.0f) * kSixth;
  VAR v2 = (3.0f * bb * b - 6.0f * bb + 4.0f) * kSixth;
  VAR v3 = aa * a * kSixth;
  VAR s0 = bb * -0.5f;
  VAR s1 = a * (1.5f * a - 2.0f);
  VAR s2 = b * (2.0f - 1.5f * b);
  VAR s3 = aa * 0.5f;
  VAR b1 = 3.0f * a - 2.0f;
  VAR b2 = 3.0f * b - 2.0f;
  Weights w;
  w.value[0] = v0;
  w.value[1] = v1;
  w.value[2] = v2;
  w.value[3] = v3;
  w.slope[0] = s0;
  w.slope[1] = s1;
  w.slope[2] = s2;
  w.slope[3] = s3;
  w.bend[0] = b;
  w.bend[1] = b1;
  w.bend[2] = b2;
  w.bend[3] = a;
  return w;
}

struct Shape {
  Real gx, gy, gz;                    // gradient of the B-spline, φ by grid points
  Real tx, ty, tz;                    // of the trilinear interpolant
  Real hxx, hyy, hzz, hxy, hxz, hyz;  // of the B-spline
  Real error;                         // bound on |trilinear − smooth|, from second differences
};

Real magnitude(Real v) { return select(v < 0.0f, 0.0f - v, v); }

// @param cell  that holds the place
// @param a, b, c  the place in it, from 0 to 1
Shape shapeAt(Bool asked, Whole cellX, Whole cellY, Whole cellZ, Real a, Real b, Real c) {
  Window w = windowAt(asked, cellX, cellY, cellZ);
  VAR f[216];
  for (int i = 0; i < 6; ++i) {
    for (int j = 0; j < 6; ++j) {
      Whole nearBlocks = columnAt(w, i, j, 0);
      Whole farBlocks = columnAt(w, i, j, 1);
      for (int k = 0; k < 6; ++k) {
        int rims = int(i == 0 || i == 5) + int(j == 0 || j == 5) + int(k == 0 || k == 5);
        if (rims > 1) continue;  // nobody asks for those
        f[36 * i + 6 * j + k] = loadValue(select(w.farZ[k], farBlocks, nearBlocks) + w.stepZ[k]);
      }
    }
  }

  Weights x = splineWeights(a);
  Weights y = splineWeights(b);
  Weights z = splineWeights(c);
  VAR error = real(0.0f);
  VAR gx = real(0.0f);
  VAR gy = real(0.0f);
  VAR gz = real(0.0f);
  VAR hxx = real(0.0f);
  VAR hyy = real(0.0f);
  VAR hzz = real(0.0f);
  VAR hxy = real(0.0f);
  VAR hxz = real(0.0f);
  VAR hyz = real(0.0f);
  for (int i = 0; i < 4; ++i) {
    // Of a slab across x: value and derivatives along y and z.
    VAR p = real(0.0f);
    VAR py = real(0.0f);
    VAR pz = real(0.0f);
    VAR pyy = real(0.0f);
    VAR pyz = real(0.0f);
    VAR pzz = real(0.0f);
    for (int j = 0; j < 4; ++j) {
      VAR q = real(0.0f);
      VAR qz = real(0.0f);
      VAR qzz = real(0.0f);
      for (int k = 0; k < 4; ++k) {
        int n = 36 * (i + 1) + 6 * (j + 1) + (k + 1);
        VAR twice = f[n] + f[n];
        VAR bendX = (f[n - 36] + f[n + 36]) - twice;
        VAR bendY = (f[n - 6] + f[n + 6]) - twice;
        VAR bendZ = (f[n - 1] + f[n + 1]) - twice;
        VAR coefficient = f[n];
        if (!isSpline) coefficient = f[n] - ((bendX + bendY) + bendZ) * kSixth;
        q = q + coefficient * z.value[k];
        qz = qz + coefficient * z.slope[k];
        qzz = qzz + coefficient * z.bend[k];
        if ((i == 1 || i == 2) && (j == 1 || j == 2) && (k == 1 || k == 2)) {
          VAR most = ((magnitude(bendX) + magnitude(bendY)) + magnitude(bendZ)) * kEighth;
          error = larger(error, most);
        }
      }
      p = p + q * y.value[j];
      py = py + q * y.slope[j];
      pyy = pyy + q * y.bend[j];
      pz = pz + qz * y.value[j];
      pyz = pyz + qz * y.slope[j];
      pzz = pzz + qzz * y.value[j];
    }
    gx = gx + p * x.slope[i];
    gy = gy + py * x.value[i];
    gz = gz + pz * x.value[i];
    hxx = hxx + p * x.bend[i];
    hxy = hxy + py * x.slope[i];
    hxz = hxz + pz * x.slope[i];
    hyy = hyy + pyy * x.value[i];
    hyz = hyz + pyz * x.value[i];
    hzz = hzz + pzz * x.value[i];
  }

  VAR tx = real(0.0f);
  VAR ty = real(0.0f);
  VAR tz = real(0.0f);
  VAR ra = 1.0f - a;
  VAR rb = 1.0f - b;
  VAR rc = 1.0f - c;
  for (int i = 0; i < 2; ++i) {
    for (int j = 0; j < 2; ++j) {
      for (int k = 0; k < 2; ++k) {
        VAR corner = f[36 * (2 + i) + 6 * (2 + j) + (2 + k)];
        VAR wx = i == 1 ? a : ra;
        VAR wy = j == 1 ? b : rb;
        VAR wz = k == 1 ? c : rc;
        VAR onX = corner * wy * wz;
        VAR onY = corner * wx * wz;
        VAR onZ = corner * wx * wy;
        tx = i == 1 ? tx + onX : tx - onX;
        ty = j == 1 ? ty + onY : ty - onY;
        tz = k == 1 ? tz + onZ : tz - onZ;
      }
    }
  }
  if (isSpline) {  // the surface that rays meet
    tx = gx;
    ty = gy;
    tz = gz;
    error = real(0.0f);
  }
  Shape shape;
  shape.gx = gx;
  shape.gy = gy;
  shape.gz = gz;
  shape.tx = tx;
  shape.ty = ty;
  shape.tz = tz;
  shape.hxx = hxx;
  shape.hyy = hyy;
  shape.hzz = hzz;
  shape.hxy = hxy;
  shape.hxz = hxz;
  shape.hyz = hyz;
  shape.error = error;
  return shape;
}

// Where a ray meets the surface.
Shape shapeOf(IN(Ray) ray, IN(Hit) hit) {
  VAR x = (ray.ox - toReal(hit.x)) + hit.t * ray.dx;
  VAR y = (ray.oy - toReal(hit.y)) + hit.t * ray.dy;
  VAR z = (ray.oz - toReal(hit.z)) + hit.t * ray.dz;
  VAR a = smaller(larger(x, 0.0f), 1.0f);
  VAR b = smaller(larger(y, 0.0f), 1.0f);
  VAR c = smaller(larger(z, 0.0f), 1.0f);
  return shapeAt(hit.found, hit.x, hit.y, hit.z, a, b, c);
}
