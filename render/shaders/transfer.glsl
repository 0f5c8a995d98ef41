// Transfer function of direct volume rendering. The code is valid GLSL and C++, in double precision,
// and follows grid_walk.glsl. C++ includes it into a class (render/direct/light_kernel.h).
//
// Extinction and colour are linear between the points of the function, and constant beyond them. So
// each piece has a first value, a width, the extinction and its slope, the colour, and the
// difference to the colour of the next point. The first piece and the last extend to infinity. The
// width is 0 in a piece of one colour. `steps` counts the iterations of loops, with the one that ends
// each loop, because drivers limit their sum.

CONST_INT kPieceNumbers = 10;  // numbers of a piece
CONST_INT kWidth = 1;
CONST_INT kExtinction = 2;
CONST_INT kSlope = 3;
CONST_INT kColour = 4;
CONST_INT kTurn = 7;

double pieceLow(int n) { return pieceNumber(n * kPieceNumbers); }

// Number of the piece that holds a value.
int pieceAt(double value, INOUT(int) steps) {
  int n = pieceCount - 1;
  ++steps;
  while (n > 0 && value < pieceLow(n)) {
    n = n - 1;
    ++steps;
  }
  return n;
}

double extinctionIn(int n, double value) {
  double constant = pieceNumber(n * kPieceNumbers + kExtinction);
  double slope = pieceNumber(n * kPieceNumbers + kSlope);
  double low = slope == 0.0 ? value : pieceLow(n);  // not infinite
  // At the end of a piece, rounding may leave a negative number.
  VAR linear = constant + slope * (value - low);
  return slope == 0.0 ? constant : greater(linear, 0.0);
}

// Position of a value between the colours of a piece, from 0 to 1; 0 in a piece of one colour.
double turnAt(int n, double value) {
  double width = pieceNumber(n * kPieceNumbers + kWidth);
  if (width == 0.0) return 0.0;
  VAR share = (value - pieceLow(n)) / width;
  return share;
}

// Colour of one channel, 0 … 2, times the extinction.
double emissionIn(int n, int channel, double turn, double extinction) {
  VAR colour = pieceNumber(n * kPieceNumbers + kColour + channel) +
               pieceNumber(n * kPieceNumbers + kTurn + channel) * turn;
  VAR emission = colour * extinction;
  return emission;
}

// Bounds over a range of values: the largest extinction and its largest change for a change of the
// value.
struct Bounds {
  double extinction, slope;
};

Bounds boundsBetween(double low, double high, INOUT(int) steps) {
  int n = pieceAt(low, steps);
  Bounds bounds;
  bounds.extinction = extinctionIn(n, low);
  bounds.slope = magnitude(pieceNumber(n * kPieceNumbers + kSlope));
  ++steps;
  while (n + 1 < pieceCount && pieceLow(n + 1 < pieceCount ? n + 1 : n) < high) {
    n = n + 1;
    ++steps;
    bounds.extinction = greater(bounds.extinction, pieceNumber(n * kPieceNumbers + kExtinction));
    bounds.slope = greater(bounds.slope, magnitude(pieceNumber(n * kPieceNumbers + kSlope)));
  }
  bounds.extinction = greater(bounds.extinction, extinctionIn(n, high));
  return bounds;
}

// Part of a run of linear values that lies between two points: its share of the run, and the means
// of extinction and emission on it.
struct Part {
  bool isLast;
  double share, extinction, red, green, blue;
};

double simpson(double first, double middle, double last) {
  VAR mean = (first + middle * 4.0 + last) / 6.0;
  return mean;
}

// Number of the piece in which a run of linear values starts.
int firstPiece(double from, double to, INOUT(int) steps) {
  int n = pieceAt(from, steps);
  return from > to && n > 0 && from == pieceLow(n) ? n - 1 : n;
}

// Next part of a run whose values go linearly from `from` to `to`.
// @param n  number of the piece; that of the next part afterwards
// @param at  value at the start of the part; at its end afterwards
Part nextPart(double from, double to, INOUT(int) n, INOUT(double) at) {
  bool isRising = from <= to;
  int present = n;
  int above = n + 1 < pieceCount ? n + 1 : n;
  double border = pieceLow(isRising ? above : n);
  Part part;
  part.isLast = isRising ? (above == n || border >= to) : (n == 0 || border <= to);
  double next = part.isLast ? to : border;
  bool isWhole = part.isLast && at == from;
  double span = isWhole ? 1.0 : to - from;
  VAR share = (next - at) / span;
  VAR middle = 0.5 * (at + next);
  part.share = isWhole ? 1.0 : share;
  part.extinction = extinctionIn(present, middle);
  double turn = turnAt(present, middle);
  part.red = emissionIn(present, 0, turn, part.extinction);
  part.green = emissionIn(present, 1, turn, part.extinction);
  part.blue = emissionIn(present, 2, turn, part.extinction);
  if (pieceNumber(present * kPieceNumbers + kSlope) != 0.0 ||
      pieceNumber(present * kPieceNumbers + kWidth) != 0.0) {
    // Simpson's rule is exact for quadratic polynomials.
    double low = extinctionIn(present, at);
    double high = extinctionIn(present, next);
    double lowTurn = turnAt(present, at);
    double highTurn = turnAt(present, next);
    part.red = simpson(emissionIn(present, 0, lowTurn, low), part.red,
                       emissionIn(present, 0, highTurn, high));
    part.green = simpson(emissionIn(present, 1, lowTurn, low), part.green,
                         emissionIn(present, 1, highTurn, high));
    part.blue = simpson(emissionIn(present, 2, lowTurn, low), part.blue,
                        emissionIn(present, 2, highTurn, high));
  }
  at = next;
  n = isRising ? above : n - 1;
  return part;
}
