// Square roots that are rounded as IEEE 754 requires. The code is valid GLSL and C++, in double
// precision. Its user defines nextAbove() and nextBelow().

// The upper half of the bits of a number [Dekker71].
double upperHalf(double a) {
  VAR scaled = double(134217729) * a;  // 2^27 + 1
  VAR rest = scaled - a;
  VAR upper = scaled - rest;
  return upper;
}

// Returns the correctly rounded square root of `a`, which is `root` or one of its neighbours. The
// exact remainder is compared with that in the middle between two neighbours. All terms are
// multiples of the squared distance of neighbours, so the comparisons are exact.
double roundedRoot(double a, double root) {
  VAR square = root * root;
  VAR high = upperHalf(root);
  VAR low = root - high;
  VAR lost = (high * high - square) + 2.0 * high * low + low * low;
  VAR remainder = (a - square) - lost;
  double above = nextAbove(root);
  double below = nextBelow(root);
  VAR toMiddleAbove = root * (above - root);
  VAR toMiddleBelow = root * (below - root);
  return remainder > toMiddleAbove ? above : (remainder <= toMiddleBelow ? below : root);
}
