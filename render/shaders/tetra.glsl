// Crossings of a ray with the zero set of a spline on the type-6 partition [Kalbe11]: the quadratic
// super spline or the cubic C1 spline. Types and coordinates are those of roots.glsl, but table
// space is shifted by half a voxel: the datum (i, j, k) lies in the middle of cell (i, j, k), which
// is a cube of the partition. Six planes through its middle split it into 24 tetrahedra.
//
// A tetrahedron is reflected and turned so that X >= Y >= |Z| in it, where X, Y, Z are coordinates
// from the middle of the cube. The 27 data around the cube are stored as even and odd parts along
// each axis: a reflection then changes signs, and exchanging two axes exchanges numbers.

// The 27 data around a cube. The digits stand for x, y and z: 0 for the data in the middle, 1 for
// the mean of the two beside it, 2 for half their difference.
struct Cube {
  Real c000, c001, c002, c010, c011, c012, c020, c021, c022,
       c100, c101, c102, c110, c111, c112, c120, c121, c122,
       c200, c201, c202, c210, c211, c212, c220, c221, c222;
};

Cube cubeData(Bool asked, Int brick, Int x, Int y, Int z) {
  Int corner = ((x & 7) * kCubeEdge + (y & 7)) * kCubeEdge + (z & 7);
  Int first = select(asked, brick * kCubeValues + corner, integer(0));
  Real d000;
  Real d001;
  Real d002;
  loadThree(first, d000, d001, d002);
  Real d010;
  Real d011;
  Real d012;
  loadThree(first + (kCubeEdge), d010, d011, d012);
  Real d020;
  Real d021;
  Real d022;
  loadThree(first + (2 * kCubeEdge), d020, d021, d022);
  Real d100;
  Real d101;
  Real d102;
  loadThree(first + (kCubeEdge * kCubeEdge), d100, d101, d102);
  Real d110;
  Real d111;
  Real d112;
  loadThree(first + (kCubeEdge * kCubeEdge + kCubeEdge), d110, d111, d112);
  Real d120;
  Real d121;
  Real d122;
  loadThree(first + (kCubeEdge * kCubeEdge + 2 * kCubeEdge), d120, d121, d122);
  Real d200;
  Real d201;
  Real d202;
  loadThree(first + (2 * kCubeEdge * kCubeEdge), d200, d201, d202);
  Real d210;
  Real d211;
  Real d212;
  loadThree(first + (2 * kCubeEdge * kCubeEdge + kCubeEdge), d210, d211, d212);
  Real d220;
  Real d221;
  Real d222;
  loadThree(first + (2 * kCubeEdge * kCubeEdge + 2 * kCubeEdge), d220, d221, d222);
  VAR e000 = d001;
  VAR e001 = (d002 + d000) * 0.5f;
  VAR e002 = (d002 - d000) * 0.5f;
  VAR e010 = d011;
  VAR e011 = (d012 + d010) * 0.5f;
  VAR e012 = (d012 - d010) * 0.5f;
  VAR e020 = d021;
  VAR e021 = (d022 + d020) * 0.5f;
  VAR e022 = (d022 - d020) * 0.5f;
  VAR e100 = d101;
  VAR e101 = (d102 + d100) * 0.5f;
  VAR e102 = (d102 - d100) * 0.5f;
  VAR e110 = d111;
  VAR e111 = (d112 + d110) * 0.5f;
  VAR e112 = (d112 - d110) * 0.5f;
  VAR e120 = d121;
  VAR e121 = (d122 + d120) * 0.5f;
  VAR e122 = (d122 - d120) * 0.5f;
  VAR e200 = d201;
  VAR e201 = (d202 + d200) * 0.5f;
  VAR e202 = (d202 - d200) * 0.5f;
  VAR e210 = d211;
  VAR e211 = (d212 + d210) * 0.5f;
  VAR e212 = (d212 - d210) * 0.5f;
  VAR e220 = d221;
  VAR e221 = (d222 + d220) * 0.5f;
  VAR e222 = (d222 - d220) * 0.5f;
  VAR f000 = e010;
  VAR f010 = (e020 + e000) * 0.5f;
  VAR f020 = (e020 - e000) * 0.5f;
  VAR f001 = e011;
  VAR f011 = (e021 + e001) * 0.5f;
  VAR f021 = (e021 - e001) * 0.5f;
  VAR f002 = e012;
  VAR f012 = (e022 + e002) * 0.5f;
  VAR f022 = (e022 - e002) * 0.5f;
  VAR f100 = e110;
  VAR f110 = (e120 + e100) * 0.5f;
  VAR f120 = (e120 - e100) * 0.5f;
  VAR f101 = e111;
  VAR f111 = (e121 + e101) * 0.5f;
  VAR f121 = (e121 - e101) * 0.5f;
  VAR f102 = e112;
  VAR f112 = (e122 + e102) * 0.5f;
  VAR f122 = (e122 - e102) * 0.5f;
  VAR f200 = e210;
  VAR f210 = (e220 + e200) * 0.5f;
  VAR f220 = (e220 - e200) * 0.5f;
  VAR f201 = e211;
  VAR f211 = (e221 + e201) * 0.5f;
  VAR f221 = (e221 - e201) * 0.5f;
  VAR f202 = e212;
  VAR f212 = (e222 + e202) * 0.5f;
  VAR f222 = (e222 - e202) * 0.5f;
  VAR g000 = f100;
  VAR g100 = (f200 + f000) * 0.5f;
  VAR g200 = (f200 - f000) * 0.5f;
  VAR g001 = f101;
  VAR g101 = (f201 + f001) * 0.5f;
  VAR g201 = (f201 - f001) * 0.5f;
  VAR g002 = f102;
  VAR g102 = (f202 + f002) * 0.5f;
  VAR g202 = (f202 - f002) * 0.5f;
  VAR g010 = f110;
  VAR g110 = (f210 + f010) * 0.5f;
  VAR g210 = (f210 - f010) * 0.5f;
  VAR g011 = f111;
  VAR g111 = (f211 + f011) * 0.5f;
  VAR g211 = (f211 - f011) * 0.5f;
  VAR g012 = f112;
  VAR g112 = (f212 + f012) * 0.5f;
  VAR g212 = (f212 - f012) * 0.5f;
  VAR g020 = f120;
  VAR g120 = (f220 + f020) * 0.5f;
  VAR g220 = (f220 - f020) * 0.5f;
  VAR g021 = f121;
  VAR g121 = (f221 + f021) * 0.5f;
  VAR g221 = (f221 - f021) * 0.5f;
  VAR g022 = f122;
  VAR g122 = (f222 + f022) * 0.5f;
  VAR g222 = (f222 - f022) * 0.5f;
  Cube c;
  c.c000 = g000;
  c.c001 = g001;
  c.c002 = g002;
  c.c010 = g010;
  c.c011 = g011;
  c.c012 = g012;
  c.c020 = g020;
  c.c021 = g021;
  c.c022 = g022;
  c.c100 = g100;
  c.c101 = g101;
  c.c102 = g102;
  c.c110 = g110;
  c.c111 = g111;
  c.c112 = g112;
  c.c120 = g120;
  c.c121 = g121;
  c.c122 = g122;
  c.c200 = g200;
  c.c201 = g201;
  c.c202 = g202;
  c.c210 = g210;
  c.c211 = g211;
  c.c212 = g212;
  c.c220 = g220;
  c.c221 = g221;
  c.c222 = g222;
  return c;
}

// Reflects the data along the axes with a sign of −1.
void reflectCube(INOUT(Cube) c, Real x, Real y, Real z) {
  VAR xy = x * y;
  VAR xz = x * z;
  VAR yz = y * z;
  VAR xyz = xy * z;
  c.c002 = c.c002 * z;
  c.c012 = c.c012 * z;
  c.c020 = c.c020 * y;
  c.c021 = c.c021 * y;
  c.c022 = c.c022 * yz;
  c.c102 = c.c102 * z;
  c.c112 = c.c112 * z;
  c.c120 = c.c120 * y;
  c.c121 = c.c121 * y;
  c.c122 = c.c122 * yz;
  c.c200 = c.c200 * x;
  c.c201 = c.c201 * x;
  c.c202 = c.c202 * xz;
  c.c210 = c.c210 * x;
  c.c211 = c.c211 * x;
  c.c212 = c.c212 * xz;
  c.c220 = c.c220 * xy;
  c.c221 = c.c221 * xy;
  c.c222 = c.c222 * xyz;
}

void exchange(Bool when, INOUT(Real) a, INOUT(Real) b) {
  Real held = a;
  a = select(when, b, a);
  b = select(when, held, b);
}

void exchangeXY(Bool when, INOUT(Cube) c) {
  exchange(when, c.c010, c.c100);
  exchange(when, c.c011, c.c101);
  exchange(when, c.c012, c.c102);
  exchange(when, c.c020, c.c200);
  exchange(when, c.c021, c.c201);
  exchange(when, c.c022, c.c202);
  exchange(when, c.c120, c.c210);
  exchange(when, c.c121, c.c211);
  exchange(when, c.c122, c.c212);
}

void exchangeXZ(Bool when, INOUT(Cube) c) {
  exchange(when, c.c001, c.c100);
  exchange(when, c.c002, c.c200);
  exchange(when, c.c011, c.c110);
  exchange(when, c.c012, c.c210);
  exchange(when, c.c021, c.c120);
  exchange(when, c.c022, c.c220);
  exchange(when, c.c102, c.c201);
  exchange(when, c.c112, c.c211);
  exchange(when, c.c122, c.c221);
}

void exchangeYZ(Bool when, INOUT(Cube) c) {
  exchange(when, c.c001, c.c010);
  exchange(when, c.c002, c.c020);
  exchange(when, c.c012, c.c021);
  exchange(when, c.c101, c.c110);
  exchange(when, c.c102, c.c120);
  exchange(when, c.c112, c.c121);
  exchange(when, c.c201, c.c210);
  exchange(when, c.c202, c.c220);
  exchange(when, c.c212, c.c221);
}

// Signs and exchanges that turn the tetrahedron with a point to X >= Y >= |Z|.
struct Turn {
  Real signX, signY, signZ;
  Bool xy, xz, yz;  // exchanges, in this order, after the reflections
};

Turn turnAt(Real x, Real y, Real z) {
  Turn turn;
  turn.signX = select(x < 0.0f, real(-1.0f), real(1.0f));
  turn.signY = select(y < 0.0f, real(-1.0f), real(1.0f));
  turn.signZ = select(z < 0.0f, real(-1.0f), real(1.0f));
  VAR a = x * turn.signX;
  VAR b = y * turn.signY;
  VAR c = z * turn.signZ;
  turn.xy = b > a;
  Real first = select(turn.xy, b, a);
  Real second = select(turn.xy, a, b);
  turn.xz = c > first;
  Real third = select(turn.xz, first, c);
  turn.yz = third > second;
  return turn;
}

Cube turned(Cube c, IN(Turn) turn) {
  reflectCube(c, turn.signX, turn.signY, turn.signZ);
  exchangeXY(turn.xy, c);
  exchangeXZ(turn.xz, c);
  exchangeYZ(turn.yz, c);
  return c;
}

// Barycentric coordinates in a tetrahedron.
struct Weights {
  Real w0, w1, w2, w3;
};

// Barycentric coordinates of a point, given from the middle of the cube.
Weights weightsAt(Real px, Real py, Real pz, IN(Turn) turn) {
  Real x = px * turn.signX;
  Real y = py * turn.signY;
  Real z = pz * turn.signZ;
  exchange(turn.xy, x, y);
  exchange(turn.xz, x, z);
  exchange(turn.yz, y, z);
  VAR w0 = 1.0f - (x + x);
  VAR w1 = (x + x) - (y + y);
  VAR w2 = y + z;
  VAR w3 = y - z;
  Weights w;
  w.w0 = w0;
  w.w1 = w1;
  w.w2 = w2;
  w.w3 = w3;
  return w;
}

// Bernstein coefficients of a quadratic on a tetrahedron.
struct QuadraticForm {
  Real q00, q01, q02, q03, q11, q12, q13, q22, q23, q33;
};

// Bernstein coefficients of a cubic on a tetrahedron.
struct CubicForm {
  Real b000, b001, b002, b003, b011, b012, b013, b022, b023, b033,
       b111, b112, b113, b122, b123, b133, b222, b223, b233, b333;
};

// Sums of the data along axes of the cube, with halves as weights, from which the coefficients of
// both splines are made. t: along x; a: along x and y; b: along x and z; d: of the middle layer.
struct CubeSums {
  Real t00, t01, t02, t10, t11, t12, t20, t21, t22, a0, a1, a2, b2, b3, d2, d3;
};

CubeSums sumsOf(IN(Cube) c) {
  VAR t00 = ((c.c000 + c.c100) + c.c200) * 0.5f;
  VAR t01 = ((c.c001 + c.c101) + c.c201) * 0.5f;
  VAR t02 = ((c.c002 + c.c102) + c.c202) * 0.5f;
  VAR t10 = ((c.c010 + c.c110) + c.c210) * 0.5f;
  VAR t11 = ((c.c011 + c.c111) + c.c211) * 0.5f;
  VAR t12 = ((c.c012 + c.c112) + c.c212) * 0.5f;
  VAR t20 = ((c.c020 + c.c120) + c.c220) * 0.5f;
  VAR t21 = ((c.c021 + c.c121) + c.c221) * 0.5f;
  VAR t22 = ((c.c022 + c.c122) + c.c222) * 0.5f;
  VAR a0 = ((t00 + t10) + t20) * 0.5f;
  VAR a1 = ((t01 + t11) + t21) * 0.5f;
  VAR a2 = ((t02 + t12) + t22) * 0.5f;
  VAR b2 = ((t00 + t01) + t02) * 0.5f;
  VAR b3 = ((t00 + t01) - t02) * 0.5f;
  VAR f0 = ((c.c000 + c.c010) + c.c020) * 0.5f;
  VAR f1 = ((c.c001 + c.c011) + c.c021) * 0.5f;
  VAR f2 = ((c.c002 + c.c012) + c.c022) * 0.5f;
  VAR d2 = ((f0 + f1) + f2) * 0.5f;
  VAR d3 = ((f0 + f1) - f2) * 0.5f;
  CubeSums sums;
  sums.t00 = t00;
  sums.t01 = t01;
  sums.t02 = t02;
  sums.t10 = t10;
  sums.t11 = t11;
  sums.t12 = t12;
  sums.t20 = t20;
  sums.t21 = t21;
  sums.t22 = t22;
  sums.a0 = a0;
  sums.a1 = a1;
  sums.a2 = a2;
  sums.b2 = b2;
  sums.b3 = b3;
  sums.d2 = d2;
  sums.d3 = d3;
  return sums;
}

QuadraticForm quadraticForm(IN(Cube) c) {
  CubeSums s = sumsOf(c);
  VAR q22 = ((s.a0 + s.a1) + s.a2) * 0.5f;
  VAR q33 = ((s.a0 + s.a1) - s.a2) * 0.5f;
  VAR q23 = s.a0;
  VAR q12 = (s.a0 + s.b2) * 0.5f;
  VAR q13 = (s.a0 + s.b3) * 0.5f;
  VAR q11 = s.t00 * 0.5f + (s.t10 + s.t01) * 0.25f;
  VAR q02 = (((s.a0 + s.b2) + s.d2) - q22) * 0.5f;
  VAR q03 = (((s.a0 + s.b3) + s.d3) - q33) * 0.5f;
  VAR faces = 5.0f * c.c000 + 3.0f * ((c.c100 + c.c200) + (c.c010 + c.c001));
  VAR edges = ((c.c110 + c.c210) + (c.c101 + c.c201)) + c.c011;
  VAR q01 = (faces + (edges - (c.c111 + c.c211))) * 0.0625f;
  VAR q00 = ((5.0f * c.c000 + 3.0f * ((c.c100 + c.c010) + c.c001)) + (((c.c110 + c.c101) + c.c011) - c.c111)) * 0.0625f;
  QuadraticForm q;
  q.q00 = q00;
  q.q01 = q01;
  q.q02 = q02;
  q.q03 = q03;
  q.q11 = q11;
  q.q12 = q12;
  q.q13 = q13;
  q.q22 = q22;
  q.q23 = q23;
  q.q33 = q33;
  return q;
}

CubicForm cubicForm(IN(Cube) c) {
  CubeSums s = sumsOf(c);
  VAR p00 = c.c100 + c.c200;
  VAR p01 = c.c101 + c.c201;
  VAR p02 = c.c102 + c.c202;
  VAR p10 = c.c110 + c.c210;
  VAR p20 = c.c120 + c.c220;
  VAR b222 = ((s.a0 + s.a1) + s.a2) * 0.5f;
  VAR b333 = ((s.a0 + s.a1) - s.a2) * 0.5f;
  VAR b223 = ((5.0f * s.a0 + s.a1) + s.a2) * NUMBER(1.0 / 6.0);
  VAR b233 = ((5.0f * s.a0 + s.a1) - s.a2) * NUMBER(1.0 / 6.0);
  VAR e12 = (5.0f * s.t00 + 3.0f * ((s.t10 + s.t20) + s.t01)) + (s.t11 + s.t21);
  VAR o12 = (3.0f * s.t02 + s.t12) + s.t22;
  VAR b122 = (e12 + o12) * NUMBER(1.0 / 12.0);
  VAR b133 = (e12 - o12) * NUMBER(1.0 / 12.0);
  VAR b123 = ((13.0f * s.t00 + 7.0f * (s.t10 + s.t20)) + (3.0f * s.t01 + (s.t11 + s.t21))) * NUMBER(1.0 / 24.0);
  VAR e11 = (26.0f * s.t00 + 10.0f * (s.t10 + s.t01)) + 2.0f * s.t11;
  VAR e112 = (e11 + 7.0f * s.t20) + s.t21;
  VAR o112 = 7.0f * s.t02 + s.t12;
  VAR b112 = (e112 + o112) * NUMBER(1.0 / 48.0);
  VAR b113 = (e112 - o112) * NUMBER(1.0 / 48.0);
  VAR b111 = e11 * NUMBER(1.0 / 48.0);
  VAR b022 = ((s.a0 + s.b2) + s.d2) * NUMBER(1.0 / 3.0);
  VAR b033 = ((s.a0 + s.b3) + s.d3) * NUMBER(1.0 / 3.0);
  VAR e23 = (8.0f * c.c000 + 5.0f * (p00 + (c.c010 + c.c020))) + 2.0f * (p10 + p20);
  VAR b023 = (e23 + (2.0f * c.c001 + ((p01 + c.c011) + c.c021))) * NUMBER(1.0 / 24.0);
  VAR e01 = ((16.0f * c.c000 + 10.0f * p00) + 7.0f * (c.c010 + c.c001)) + (3.0f * (p10 + p01) + 2.0f * c.c011);
  VAR e012 = ((e01 + 5.0f * c.c020) + 2.0f * p20) + c.c021;
  VAR o012 = (5.0f * c.c002 + 2.0f * p02) + c.c012;
  VAR b012 = (e012 + o012) * NUMBER(1.0 / 48.0);
  VAR b013 = (e012 - o012) * NUMBER(1.0 / 48.0);
  VAR b011 = e01 * NUMBER(1.0 / 48.0);
  VAR e00 = (18.0f * c.c000 + 8.0f * ((c.c100 + c.c010) + c.c001)) + 2.0f * ((c.c110 + c.c101) + c.c011);
  VAR e002 = (e00 + 6.0f * (c.c200 + c.c020)) + ((c.c120 + c.c210) + (c.c201 + c.c021));
  VAR o002 = 6.0f * c.c002 + (c.c102 + c.c012);
  VAR b002 = (e002 + o002) * NUMBER(1.0 / 48.0);
  VAR b003 = (e002 - o002) * NUMBER(1.0 / 48.0);
  VAR b001 = (e00 + (6.0f * c.c200 + (c.c210 + c.c201))) * NUMBER(1.0 / 48.0);
  VAR b000 = e00 * NUMBER(1.0 / 48.0);
  CubicForm b;
  b.b000 = b000;
  b.b001 = b001;
  b.b002 = b002;
  b.b003 = b003;
  b.b011 = b011;
  b.b012 = b012;
  b.b013 = b013;
  b.b022 = b022;
  b.b023 = b023;
  b.b033 = b033;
  b.b111 = b111;
  b.b112 = b112;
  b.b113 = b113;
  b.b122 = b122;
  b.b123 = b123;
  b.b133 = b133;
  b.b222 = b222;
  b.b223 = b223;
  b.b233 = b233;
  b.b333 = b333;
  return b;
}

Real weighted(IN(Weights) w, Real a0, Real a1, Real a2, Real a3) {
  VAR sum = (w.w0 * a0 + w.w1 * a1) + (w.w2 * a2 + w.w3 * a3);
  return sum;
}

// The blossom of a cubic with one argument fixed.
QuadraticForm fixedAt(IN(CubicForm) b, IN(Weights) w) {
  QuadraticForm q;
  q.q00 = weighted(w, b.b000, b.b001, b.b002, b.b003);
  q.q01 = weighted(w, b.b001, b.b011, b.b012, b.b013);
  q.q02 = weighted(w, b.b002, b.b012, b.b022, b.b023);
  q.q03 = weighted(w, b.b003, b.b013, b.b023, b.b033);
  q.q11 = weighted(w, b.b011, b.b111, b.b112, b.b113);
  q.q12 = weighted(w, b.b012, b.b112, b.b122, b.b123);
  q.q13 = weighted(w, b.b013, b.b113, b.b123, b.b133);
  q.q22 = weighted(w, b.b022, b.b122, b.b222, b.b223);
  q.q23 = weighted(w, b.b023, b.b123, b.b223, b.b233);
  q.q33 = weighted(w, b.b033, b.b133, b.b233, b.b333);
  return q;
}

// The blossom of a quadratic with one argument fixed, as weights of the other argument.
Weights fixedAt(IN(QuadraticForm) q, IN(Weights) w) {
  Weights row;
  row.w0 = weighted(w, q.q00, q.q01, q.q02, q.q03);
  row.w1 = weighted(w, q.q01, q.q11, q.q12, q.q13);
  row.w2 = weighted(w, q.q02, q.q12, q.q22, q.q23);
  row.w3 = weighted(w, q.q03, q.q13, q.q23, q.q33);
  return row;
}

Real weighted(IN(Weights) w, IN(Weights) a) { return weighted(w, a.w0, a.w1, a.w2, a.w3); }

// Share of a segment at which a linear function with the values a and b at its ends changes sign; 1
// if it does not.
Real shareOf(Real a, Real b) {
  VAR change = a - b;
  VAR share = quotient(a, change);
  return select(differ(a < 0.0f, b < 0.0f), share, real(1.0f));
}

void ascend(INOUT(Real) a, INOUT(Real) b) {
  Real low = smaller(a, b);
  b = larger(a, b);
  a = low;
}

// Finds a crossing of a ray with the spline's zero set between two points of a cell, in one
// tetrahedron after the other. Parameters as for crossingIn() and splineCrossingIn().
Crossing tetraCrossingIn(Bool asked, Int brick, Int cellX, Int cellY, Int cellZ, Real x0, Real y0,
                         Real z0, Real x1, Real y1, Real z1, Bool carried, Bool inside,
                         INOUT(Int) passing) {
  Cube data = cubeData(asked, brick, cellX, cellY, cellZ);
  VAR ax = x0 - 0.5f;
  VAR ay = y0 - 0.5f;
  VAR az = z0 - 0.5f;
  VAR bx = x1 - 0.5f;
  VAR by = y1 - 0.5f;
  VAR bz = z1 - 0.5f;
  // Shares of the segment at which it meets the six planes, sorted by a network.
  Real s0 = shareOf(ax - ay, bx - by);
  Real s1 = shareOf(ax + ay, bx + by);
  Real s2 = shareOf(ay - az, by - bz);
  Real s3 = shareOf(ay + az, by + bz);
  Real s4 = shareOf(ax - az, bx - bz);
  Real s5 = shareOf(ax + az, bx + bz);
  ascend(s0, s5);
  ascend(s1, s3);
  ascend(s2, s4);
  ascend(s1, s2);
  ascend(s3, s4);
  ascend(s0, s3);
  ascend(s2, s5);
  ascend(s0, s1);
  ascend(s2, s3);
  ascend(s4, s5);
  ascend(s1, s2);
  ascend(s3, s4);
  Crossing crossing;
  crossing.found = no();
  crossing.enters = no();
  crossing.share = real(0.0f);
  // The cubic of the segment with the crossing, the part of it that holds the crossing, and the ends
  // of the segment.
  Real h0 = real(0.0f);
  Real h1 = real(0.0f);
  Real h2 = real(0.0f);
  Real h3 = real(0.0f);
  Real foundLow = real(0.0f);
  Real foundHigh = real(0.0f);
  Real begin = real(0.0f);
  Real end = real(0.0f);
  Bool open = asked;
  Bool known = carried;
  Bool side = inside;
  VAR from = real(0.0f);
  VAR px = ax;
  VAR py = ay;
  VAR pz = az;
  Bool more = open;
  while (any(more)) {
    Real to = s0;
    s0 = s1;
    s1 = s2;
    s2 = s3;
    s3 = s4;
    s4 = s5;
    s5 = real(1.0f);
    VAR rest = 1.0f - to;
    VAR qx = between(ax, bx, to, rest);
    VAR qy = between(ay, by, to, rest);
    VAR qz = between(az, bz, to, rest);
    Bool searched = AND(open, to > from);
    if (any(searched)) {
      Turn turn = turnAt(px + qx, py + qy, pz + qz);
      Weights wp = weightsAt(px, py, pz, turn);
      Weights wq = weightsAt(qx, qy, qz, turn);
      Cube c = turned(data, turn);
      Real b0;
      Real b1;
      Real b2;
      Real b3;
      if (tetraDegree == 2) {
        QuadraticForm q = quadraticForm(c);
        Weights row = fixedAt(q, wp);
        b0 = weighted(wp, row);
        Real m = weighted(wq, row);
        b3 = weighted(wq, fixedAt(q, wq));
        // Bernstein coefficients of the same quadratic as a cubic.
        VAR c1 = (b0 + (m + m)) * kThird;
        VAR c2 = ((m + m) + b3) * kThird;
        b1 = c1;
        b2 = c2;
      } else {
        CubicForm b = cubicForm(c);
        QuadraticForm atP = fixedAt(b, wp);
        QuadraticForm atQ = fixedAt(b, wq);
        Weights row = fixedAt(atP, wp);
        b0 = weighted(wp, row);
        b1 = weighted(wq, row);
        Weights last = fixedAt(atQ, wq);
        b2 = weighted(wp, last);
        b3 = weighted(wq, last);
      }
      b0 = select(known, onSide(b0, side), b0);
      Real low;
      Real high;
      Bool found = isolate(searched, b0, b1, b2, b3, passing, low, high);
      if (any(found)) {
        // The roots of all lanes are computed together after the loop.
        h0 = select(found, b0, h0);
        h1 = select(found, b1, h1);
        h2 = select(found, b2, h2);
        h3 = select(found, b3, h3);
        foundLow = select(found, low, foundLow);
        foundHigh = select(found, high, foundHigh);
        begin = select(found, from, begin);
        end = select(found, to, end);
        crossing.found = OR(crossing.found, found);
        open = AND(open, NOT(found));
      }
      side = select(searched, b3 < 0.0f, side);
      known = OR(known, searched);
    }
    px = qx;
    py = qy;
    pz = qz;
    from = to;
    more = AND(open, from < 1.0f);
  }
  crossing.endsInside = side;
  if (any(crossing.found)) {
    Bool startsInside = blossom(h0, h1, h2, h3, foundLow, foundLow, foundLow) < 0.0f;
    Real within = bisect(h0, h1, h2, h3, startsInside, foundLow, foundHigh);
    VAR share = begin + within * (end - begin);
    crossing.share = share;
    crossing.enters = NOT(startsInside);
  }
  return crossing;
}
