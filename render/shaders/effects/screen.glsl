// Effects from the layers of a picture: outlines, and rays that are followed in the picture. The
// code is valid GLSL and C++, in double precision. C++ includes it into a class
// (render/effects/screen_kernel.h). Its user defines
//   int width, height; bool isPerspective;
//   double pixelDepth(int x, int y);            distance along the view axis; negative: no surface
//   double pixelNormal(int x, int y, int axis); unit normal, towards the eye
//   double earlierAt(int x, int y);             result of the pass before
//   double number(int n); double rootOf(double a);
//
// Positions are in camera space: x to the right, y downwards in the picture, z along the view.

CONST_INT kStepX = 0;  // width of a pixel: at unit depth, or in world units (orthographic)
CONST_INT kStepY = 1;
CONST_INT kOutlineHalf = 2;     // half width of the outlines, pixels
CONST_INT kOutlineSpacing = 3;  // distance of the samples of Sobel's masks, pixels
CONST_INT kOutlineStep = 4;     // jump of depth that is an outline, world units
CONST_INT kOutlineCrease = 5;   // difference of normals that is a crease
CONST_INT kRayLength = 6;       // length of the rays, world units
CONST_INT kRayGrowth = 7;       // growth of the steps along a ray, per pixel
CONST_INT kOccluderDepth = 8;   // extent of the surfaces behind those that are seen, world units
CONST_INT kRayCount = 9;        // rays in a set
CONST_INT kMiddleX = 10;        // position of the view axis in the picture, pixels
CONST_INT kFirstRay = 11;       // index of the first number of the sets of rays

CONST_INT kSetEdge = 4;    // the pixels of squares of this edge have different sets of rays
CONST_INT kTestedRays = 8; // shadow rays before the others, which are needed in penumbrae only

struct Place {
  double x, y, z;
};

double biggest(double a, double b) { return a > b ? a : b; }
double positive(double a) { return a < 0.0 ? -a : a; }
double ramp(double a) { return a < 0.0 ? 0.0 : (a > 1.0 ? 1.0 : a); }

bool isSeen(int x, int y) {
  return x >= 0 && y >= 0 && x < width && y < height && pixelDepth(x, y) >= 0.0;
}

// Width of a pixel at a depth, world units.
double pixelSize(double z) {
  VAR size = isPerspective ? number(kStepX) * z : number(kStepX);
  return size;
}

// Position of the surface in the middle of a pixel.
Place surfaceAt(int x, int y) {
  double z = pixelDepth(x, y);
  double scale = isPerspective ? z : 1.0;
  VAR right = (double(x) + 0.5 - number(kMiddleX)) * number(kStepX) * scale;
  VAR down = (double(y) + 0.5 - 0.5 * double(height)) * number(kStepY) * scale;
  Place place;
  place.x = right;
  place.y = down;
  place.z = z;
  return place;
}

// Distance of the surface in a pixel from the tangent plane in pixel (x, y), world units.
double offPlane(int x, int y, int otherX, int otherY) {
  Place here = surfaceAt(x, y);
  Place there = surfaceAt(otherX, otherY);
  VAR distance = (there.x - here.x) * pixelNormal(x, y, 0) +
                 (there.y - here.y) * pixelNormal(x, y, 1) +
                 (there.z - here.z) * pixelNormal(x, y, 2);
  return positive(distance);
}

// === Outlines

// Jump of depth between two pixels, from -1 to 1. It is 0 on planes, whatever their slope.
double jumpTo(int x, int y, int otherX, int otherY) {
  if (otherX < 0 || otherY < 0 || otherX >= width || otherY >= height) return 0.0;
  bool isHere = isSeen(x, y);
  bool isThere = isSeen(otherX, otherY);
  if (!isHere || !isThere) return isHere == isThere ? 0.0 : (isHere ? 1.0 : -1.0);
  double rise = pixelDepth(otherX, otherY) - pixelDepth(x, y);
  // Beside an outline of a smooth surface, the tangent plane contains the view ray. The plane of
  // the farther surface shows the jump.
  double offset = biggest(offPlane(x, y, otherX, otherY), offPlane(otherX, otherY, x, y));
  double nearer = rise > 0.0 ? pixelDepth(x, y) : pixelDepth(otherX, otherY);
  VAR least = 4.0 * number(kOutlineSpacing) * pixelSize(nearer);
  VAR share = offset / biggest(number(kOutlineStep), least);
  double jump = ramp(share);
  return rise < 0.0 ? -jump : jump;
}

// Change of the normal from pixel (x, y) to another one, along one axis.
double turnTo(int x, int y, int otherX, int otherY, int axis) {
  if (!isSeen(x, y) || !isSeen(otherX, otherY)) return 0.0;
  VAR turn = pixelNormal(otherX, otherY, axis) - pixelNormal(x, y, axis);
  return turn;
}

// Weight of a line, from 0 to 1, by Sobel's masks on depth (silhouettes) and normal (creases).
double outlineStrength(int x, int y) {
  int gap = int(number(kOutlineSpacing));
  double depthX = 0.0, depthY = 0.0, crease = 0.0;
  for (int i = -1; i <= 1; ++i) {
    VAR across = jumpTo(x, y, x + gap, y + i * gap) - jumpTo(x, y, x - gap, y + i * gap);
    VAR along = jumpTo(x, y, x + i * gap, y + gap) - jumpTo(x, y, x + i * gap, y - gap);
    double weight = i == 0 ? 0.5 : 0.25;
    VAR nextX = depthX + weight * across;
    VAR nextY = depthY + weight * along;
    depthX = nextX;
    depthY = nextY;
  }
  for (int axis = 0; axis < 3; ++axis) {
    double turnX = 0.0, turnY = 0.0;
    for (int i = -1; i <= 1; ++i) {
      VAR across =
          turnTo(x, y, x + gap, y + i * gap, axis) - turnTo(x, y, x - gap, y + i * gap, axis);
      VAR along =
          turnTo(x, y, x + i * gap, y + gap, axis) - turnTo(x, y, x + i * gap, y - gap, axis);
      double weight = i == 0 ? 0.5 : 0.25;
      VAR nextX = turnX + weight * across;
      VAR nextY = turnY + weight * along;
      turnX = nextX;
      turnY = nextY;
    }
    VAR square = crease + turnX * turnX + turnY * turnY;
    crease = square;
  }
  VAR square = depthX * depthX + depthY * depthY;
  VAR ofDepth = 2.0 * rootOf(square) - 0.5;
  VAR ofNormal = 2.0 * rootOf(crease) / number(kOutlineCrease) - 1.5;
  return biggest(ramp(ofDepth), ramp(ofNormal));
}

// Weight of the lines with their width. Sobel's masks give lines that are two spacings wide.
double outlineAt(int x, int y) {
  double gap = number(kOutlineSpacing);
  VAR wider = number(kOutlineHalf) - gap;
  VAR thinner = number(kOutlineHalf) / gap;
  if (wider <= 0.0) {
    VAR thin = earlierAt(x, y) * thinner;
    return thin;
  }
  int reach = int(wider) + 1;
  double most = 0.0;
  for (int dy = -reach; dy <= reach; ++dy) {
    for (int dx = -reach; dx <= reach; ++dx) {
      bool isInside = x + dx >= 0 && y + dy >= 0 && x + dx < width && y + dy < height;
      VAR cover = wider + 1.0 - rootOf(double(dx * dx + dy * dy));
      VAR weight = isInside ? ramp(cover) * earlierAt(x + dx, y + dy) : 0.0;
      most = biggest(most, weight);
    }
  }
  return most;
}

// === Rays

// True when a surface of the picture blocks a ray.
// @param along  direction, unit length
bool isBlocked(Place from, Place along, double reach) {
  VAR endZ = from.z + along.z * reach;
  // In front of the eye the ray leaves the picture.
  VAR closest = 0.05 * from.z;
  VAR shorter = (closest - from.z) / (along.z < 0.0 ? along.z : -1.0);
  double extent = isPerspective && endZ < closest ? shorter : reach;
  VAR toX = from.x + along.x * extent;
  VAR toY = from.y + along.y * extent;
  VAR toZ = from.z + along.z * extent;
  double fromScale = isPerspective ? from.z : 1.0;
  double toScale = isPerspective ? toZ : 1.0;
  VAR startX = from.x / (fromScale * number(kStepX)) + number(kMiddleX);
  VAR startY = from.y / (fromScale * number(kStepY)) + 0.5 * double(height);
  VAR endX = toX / (toScale * number(kStepX)) + number(kMiddleX);
  VAR endY = toY / (toScale * number(kStepY)) + 0.5 * double(height);
  VAR runX = endX - startX;
  VAR runY = endY - startY;
  double pixels = biggest(positive(runX), positive(runY));
  VAR drop = from.z - toZ;
  VAR product = from.z * toZ;
  double at = 0.0;
  double before = from.z;
  while (at < pixels) {
    VAR longer = number(kRayGrowth) * at;
    VAR next = at + biggest(longer, 1.0);
    at = next;
    VAR share = next / pixels;
    double part = share < 1.0 ? share : 1.0;
    VAR px = startX + runX * part;
    VAR py = startY + runY * part;
    VAR straight = from.z - drop * part;
    VAR curved = product / (isPerspective ? toZ + drop * part : 1.0);
    double z = isPerspective ? curved : straight;
    if (!(px >= 0.0 && py >= 0.0 && px < double(width) && py < double(height))) return false;
    double surface = pixelDepth(int(px), int(py));
    VAR behind = z - surface;
    VAR limit = number(kOccluderDepth) + positive(z - before);
    if (surface >= 0.0 && behind > 0.0 && behind < limit) return true;
    before = z;
  }
  return false;
}

// Start of the rays of a pixel, one and a half pixels above its surface.
Place rayStart(int x, int y) {
  Place place = surfaceAt(x, y);
  VAR lift = 1.5 * pixelSize(place.z);
  VAR right = place.x + lift * pixelNormal(x, y, 0);
  VAR down = place.y + lift * pixelNormal(x, y, 1);
  VAR forward = place.z + lift * pixelNormal(x, y, 2);
  place.x = right;
  place.y = down;
  place.z = forward;
  return place;
}

// Index of the first number of a ray of the pixel's set.
int rayNumber(int x, int y, int ray) {
  int set = (y % kSetEdge) * kSetEdge + x % kSetEdge;
  return kFirstRay + 3 * (set * int(number(kRayCount)) + ray);
}

// Share of the sky that is open: rays by the cosine to the normal, which are not blocked.
double openShare(int x, int y) {
  if (!isSeen(x, y)) return 1.0;
  double nx = pixelNormal(x, y, 0);
  double ny = pixelNormal(x, y, 1);
  double nz = pixelNormal(x, y, 2);
  // Tangents of the normal [Duff17].
  double side = nz < 0.0 ? -1.0 : 1.0;
  VAR a = -1.0 / (side + nz);
  VAR b = nx * ny * a;
  VAR sx = 1.0 + side * nx * nx * a;
  VAR sy = side * b;
  VAR sz = -side * nx;
  VAR ty = side + ny * ny * a;
  double tx = b;
  double tz = -ny;
  Place from = rayStart(x, y);
  int count = int(number(kRayCount));
  int open = 0;
  for (int ray = 0; ray < count; ++ray) {
    int n = rayNumber(x, y, ray);
    VAR dx = sx * number(n) + tx * number(n + 1) + nx * number(n + 2);
    VAR dy = sy * number(n) + ty * number(n + 1) + ny * number(n + 2);
    VAR dz = sz * number(n) + tz * number(n + 1) + nz * number(n + 2);
    Place along;
    along.x = dx;
    along.y = dy;
    along.z = dz;
    if (!isBlocked(from, along, number(kRayLength))) ++open;
  }
  VAR share = double(open) / double(count);
  return share;
}

// Share of the light of a cone that reaches the surface. Few rays are tested first. The others
// follow where these disagree, in penumbrae.
double keyShare(int x, int y) {
  if (!isSeen(x, y)) return 1.0;
  Place from = rayStart(x, y);
  int count = int(number(kRayCount));
  int tested = 0;
  int blocked = 0;
  double all = 0.0;
  double reached = 0.0;
  bool isDecided = false;
  for (int ray = 0; ray < count && !isDecided; ++ray) {
    int n = rayNumber(x, y, ray);
    Place along;
    along.x = number(n);
    along.y = number(n + 1);
    along.z = number(n + 2);
    VAR cosine = along.x * pixelNormal(x, y, 0) + along.y * pixelNormal(x, y, 1) +
                 along.z * pixelNormal(x, y, 2);
    if (cosine > 0.0) {
      bool isShadow = isBlocked(from, along, number(kRayLength));
      VAR sum = all + cosine;
      VAR part = reached + (isShadow ? 0.0 : cosine);
      all = sum;
      reached = part;
      if (isShadow) ++blocked;
      ++tested;
      isDecided = tested == kTestedRays && (blocked == 0 || blocked == tested);
    }
  }
  VAR share = reached / (all > 0.0 ? all : 1.0);
  return all > 0.0 ? share : 1.0;
}

// Mean of the pass before over the pixels of a square with all sets of rays, on the same surface.
double smoothed(int x, int y) {
  if (!isSeen(x, y)) return 1.0;
  Place place = surfaceAt(x, y);
  double sum = 0.0;
  int count = 0;
  for (int dy = -kSetEdge / 2; dy < kSetEdge / 2; ++dy) {
    for (int dx = -kSetEdge / 2; dx < kSetEdge / 2; ++dx) {
      int otherX = x + dx;
      int otherY = y + dy;
      if (isSeen(otherX, otherY)) {
        VAR likeness = pixelNormal(x, y, 0) * pixelNormal(otherX, otherY, 0) +
                       pixelNormal(x, y, 1) * pixelNormal(otherX, otherY, 1) +
                       pixelNormal(x, y, 2) * pixelNormal(otherX, otherY, 2);
        VAR farthest = 2.0 * pixelSize(place.z);
        if (likeness > 0.8 && offPlane(x, y, otherX, otherY) < farthest) {
          VAR next = sum + earlierAt(otherX, otherY);
          sum = next;
          ++count;
        }
      }
    }
  }
  VAR mean = sum / double(count > 0 ? count : 1);
  return count > 0 ? mean : earlierAt(x, y);
}
