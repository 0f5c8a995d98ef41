// First intersections of a ray with quadrics, in double precision. The code is valid GLSL and C++.
// C++ includes it into a class (render/quadrics/quadric_kernel.h). Both compute the same bits.
//
// Each function first moves the start of the ray to the point that is closest to the quadric's
// centre, so that the coefficients of the equation have the size of the quadric. Roots follow from
// the sum without cancellation, and from the product of both roots. The text before defines kNoRoot,
// which is larger than any distance.

// Kinds of render/quadrics/quadric.h.
CONST_INT kEllipsoid = 0;
CONST_INT kCylinder = 1;
CONST_INT kCone = 2;
CONST_INT kParaboloid = 3;
CONST_INT kOneSheet = 4;
CONST_INT kTwoSheet = 5;

// Faces of an intersection.
CONST_INT kSide = 0;
CONST_INT kLowCap = 1;
CONST_INT kHighCap = 2;

// A ray relative to the origin of the quadrics, with a unit direction.
struct QuadricRay {
  double x, y, z;
  double dx, dy, dz;
  double near;  // least distance of an intersection
};

// Nearest intersection so far.
struct QuadricRoot {
  double t;
  int face;
};

// Distance of the first intersection with a sphere.
double ballRoot(QuadricRay ray, double cx, double cy, double cz, double radius) {
  VAR fromX = cx - ray.x;
  VAR fromY = cy - ray.y;
  VAR fromZ = cz - ray.z;
  VAR middle = (fromX * ray.dx + fromY * ray.dy) + fromZ * ray.dz;
  VAR px = fromX - middle * ray.dx;
  VAR py = fromY - middle * ray.dy;
  VAR pz = fromZ - middle * ray.dz;
  VAR rest = radius * radius - ((px * px + py * py) + pz * pz);
  if (rest < 0.0) return kNoRoot;
  VAR reach = rootOf(rest);
  VAR first = middle - reach;
  VAR last = middle + reach;
  return first >= ray.near ? first : (last >= ray.near ? last : kNoRoot);
}

// First intersection with a cylinder from a to b with flat ends. It is convex: the ray is in it
// where it is in the cylinder without end and between the planes of the ends.
QuadricRoot stickRoot(QuadricRay ray, double ax, double ay, double az, double bx, double by,
                      double bz, double radius) {
  QuadricRoot result;
  result.t = kNoRoot;
  result.face = kSide;
  VAR wx = bx - ax;
  VAR wy = by - ay;
  VAR wz = bz - az;
  VAR square = (wx * wx + wy * wy) + wz * wz;
  VAR toX = ax + 0.5 * wx - ray.x;
  VAR toY = ay + 0.5 * wy - ray.y;
  VAR toZ = az + 0.5 * wz - ray.z;
  VAR moved = (toX * ray.dx + toY * ray.dy) + toZ * ray.dz;
  VAR ox = ray.x - ax + moved * ray.dx;
  VAR oy = ray.y - ay + moved * ray.dy;
  VAR oz = ray.z - az + moved * ray.dz;
  VAR along = (ray.dx * wx + ray.dy * wy) + ray.dz * wz;
  VAR height = (ox * wx + oy * wy) + oz * wz;
  VAR share = along / square;
  VAR ex = ray.dx - share * wx;
  VAR ey = ray.dy - share * wy;
  VAR ez = ray.dz - share * wz;
  VAR up = height / square;
  VAR qx = ox - up * wx;
  VAR qy = oy - up * wy;
  VAR qz = oz - up * wz;
  VAR steep = (ex * ex + ey * ey) + ez * ez;
  VAR first = -kNoRoot;
  VAR last = kNoRoot;
  VAR middle = 0.0;
  if (steep > 0.0) middle = -((qx * ex + qy * ey) + qz * ez) / steep;
  VAR px = qx + middle * ex;
  VAR py = qy + middle * ey;
  VAR pz = qz + middle * ez;
  VAR rest = radius * radius - ((px * px + py * py) + pz * pz);
  if (rest < 0.0) return result;
  if (steep > 0.0) {
    VAR reach = rootOf(rest / steep);
    first = middle - reach;
    last = middle + reach;
  }
  int firstFace = kSide;
  int lastFace = kSide;
  if (along == 0.0) {
    if (height < 0.0 || height > square) return result;
  } else {
    VAR low = -height / along;
    VAR high = (square - height) / along;
    VAR enter = along > 0.0 ? low : high;
    VAR leave = along > 0.0 ? high : low;
    if (enter > first) {
      first = enter;
      firstFace = along > 0.0 ? kLowCap : kHighCap;
    }
    if (leave < last) {
      last = leave;
      lastFace = along > 0.0 ? kHighCap : kLowCap;
    }
  }
  if (first > last) return result;
  VAR enters = moved + first;
  VAR leaves = moved + last;
  if (enters >= ray.near) {
    result.t = enters;
    result.face = firstFace;
  } else if (leaves >= ray.near) {
    result.t = leaves;
    result.face = lastFace;
  }
  return result;
}

// A quadric with the rows of the inverse of its axes.
struct QuadricShape {
  int kind;
  int isCapped;
  double x, y, z;
  double xx, xy, xz;
  double yx, yy, yz;
  double zx, zy, zz;
  double low, high;
};

double radiusSquareAt(int kind, double z) {
  VAR square = z * z;
  return kind == kCylinder     ? 1.0
         : kind == kCone       ? square
         : kind == kParaboloid ? z
         : kind == kOneSheet   ? square + 1.0
                               : square - 1.0;
}

QuadricRoot quadricRoot(QuadricRay ray, QuadricShape s) {
  QuadricRoot result;
  result.t = kNoRoot;
  result.face = kSide;
  VAR toX = s.x - ray.x;
  VAR toY = s.y - ray.y;
  VAR toZ = s.z - ray.z;
  VAR moved = (toX * ray.dx + toY * ray.dy) + toZ * ray.dz;
  VAR ox = moved * ray.dx - toX;
  VAR oy = moved * ray.dy - toY;
  VAR oz = moved * ray.dz - toZ;
  // The ray q + t e in parameter space, from its point closest to the origin.
  VAR ex = (s.xx * ray.dx + s.xy * ray.dy) + s.xz * ray.dz;
  VAR ey = (s.yx * ray.dx + s.yy * ray.dy) + s.yz * ray.dz;
  VAR ez = (s.zx * ray.dx + s.zy * ray.dy) + s.zz * ray.dz;
  VAR qx = (s.xx * ox + s.xy * oy) + s.xz * oz;
  VAR qy = (s.yx * ox + s.yy * oy) + s.yz * oz;
  VAR qz = (s.zx * ox + s.zy * oy) + s.zz * oz;
  VAR step = -((qx * ex + qy * ey) + qz * ez) / ((ex * ex + ey * ey) + ez * ez);
  qx = qx + step * ex;
  qy = qy + step * ey;
  qz = qz + step * ez;
  VAR start = moved + step;
  // x² + y² + curved z² + linear z + constant = 0.
  double curved = s.kind == kEllipsoid ? 1.0 : (s.kind == kCylinder || s.kind == kParaboloid ? 0.0 : -1.0);
  double linear = s.kind == kParaboloid ? -1.0 : 0.0;
  double constant = s.kind == kCone || s.kind == kParaboloid ? 0.0 : (s.kind == kTwoSheet ? 1.0 : -1.0);
  VAR a = (ex * ex + ey * ey) + curved * (ez * ez);
  VAR b = (qx * ex + qy * ey) + (curved * (qz * ez) + 0.5 * (linear * ez));
  VAR c = (qx * qx + qy * qy) + (curved * (qz * qz) + (linear * qz + constant));
  VAR rest = b * b - a * c;
  if (rest >= 0.0) {
    VAR reach = rootOf(rest);
    VAR sum = b < 0.0 ? reach - b : -(b + reach);
    for (int n = 0; n < 2; ++n) {
      if (n == 0 ? a == 0.0 : sum == 0.0) continue;
      VAR root = 0.0;
      if (n == 0) root = sum / a;
      if (n == 1) root = c / sum;
      VAR z = qz + root * ez;
      VAR t = start + root;
      bool isIn = s.kind == kEllipsoid || (z >= s.low && z <= s.high);
      if (isIn && t >= ray.near && t < result.t) {
        result.t = t;
        result.face = kSide;
      }
    }
  }
  if (s.isCapped != 0 && s.kind != kEllipsoid && ez != 0.0) {
    for (int n = 0; n < 2; ++n) {
      double z = n == 0 ? s.low : s.high;
      VAR root = (z - qz) / ez;
      VAR x = qx + root * ex;
      VAR y = qy + root * ey;
      VAR t = start + root;
      VAR square = x * x + y * y;
      if (square <= radiusSquareAt(s.kind, z) && t >= ray.near && t < result.t) {
        result.t = t;
        result.face = n == 0 ? kLowCap : kHighCap;
      }
    }
  }
  return result;
}
