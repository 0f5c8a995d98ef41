#include "render/embree/cubic_root.h"

namespace render {
namespace {

/// Number of halvings after which a part of [0, 1] is about as narrow as the spacing of doubles
/// below 1.
constexpr int kMaxDepth = 52;

int signChanges(const BernsteinCubic& b) {
  const bool s0 = b[0] < 0, s1 = b[1] < 0, s2 = b[2] < 0, s3 = b[3] < 0;
  return (s0 != s1) + (s1 != s2) + (s2 != s3);
}

struct CubicPiece {
  BernsteinCubic b;
  double low, width;
  int depth;
};

/// Splits a piece at one half by De Casteljau's algorithm: `piece` becomes the left half, the right
/// half is returned.
CubicPiece splitCubic(CubicPiece& piece) {
  const BernsteinCubic b = piece.b;
  const double b01 = 0.5 * (b[0] + b[1]), b12 = 0.5 * (b[1] + b[2]), b23 = 0.5 * (b[2] + b[3]);
  const double b012 = 0.5 * (b01 + b12), b123 = 0.5 * (b12 + b23);
  const double middle = 0.5 * (b012 + b123);
  piece.b = {b[0], b01, b012, middle};
  piece.width *= 0.5;
  ++piece.depth;
  return {{middle, b123, b23, b[3]}, piece.low + piece.width, piece.width, piece.depth};
}

/// Searches for roots (sign changes) of the cubic by halving [0, 1], from left to right. Returns
/// the first root, or -1. A piece whose coefficients have one sign has no root (convex hull). A
/// piece whose ends differ in sign has a root.
/// @param stopAtProof  true: returns as soon as a root is certain; the returned parameter is only a
/// point near it
/// @param all  if not null, receives all roots in ascending order; then the function returns -1
double searchCubic(const BernsteinCubic& cubic, bool stopAtProof,
                   std::vector<double>* all = nullptr) {
  CubicPiece stack[kMaxDepth + 1];
  int size = 0;
  CubicPiece piece{cubic, 0, 1, 0};
  for (;;) {
    const int changes = signChanges(piece.b);
    const bool isProven = changes & 1;
    if (changes > 0 && piece.depth < kMaxDepth && !(isProven && stopAtProof)) {
      stack[size++] = splitCubic(piece);
      continue;
    }
    if (isProven) {
      const double root = piece.low + 0.5 * piece.width;
      if (!all) return root;
      all->push_back(root);
    }
    if (size == 0) return -1;
    piece = stack[--size];
  }
}

}  // namespace

double firstSignChange(const BernsteinCubic& cubic) {
  return signChanges(cubic) == 0 ? -1 : searchCubic(cubic, false);
}

void addSignChanges(const BernsteinCubic& cubic, std::vector<double>& found) {
  if (signChanges(cubic) > 0) searchCubic(cubic, false, &found);
}

bool hasSignChange(const BernsteinCubic& cubic) {
  const int changes = signChanges(cubic);
  return changes != 0 && ((changes & 1) || searchCubic(cubic, true) >= 0);
}

}  // namespace render
