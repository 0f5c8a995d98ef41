#include "levelset/fields/expression.h"

#include <gtest/gtest.h>
#include <oneapi/tbb/parallel_for.h>

#include <atomic>
#include <cmath>

#include "levelset/error.h"
#include "levelset/fields/mask.h"
#include "tests/support/files.h"
#include "tests/support/measured.h"

namespace expression_test {

using namespace levelset;
using Imath::V3d;

TEST(Expression, ReadsSpaceAndTime) {
  const ScalarField field = scalarExpression("x + 2*y - z^2 + sin(pi/2) + r");
  EXPECT_NEAR(field(V3d(3, 4, 0)), 3 + 8 + 1 + 5, support::doubleRounding(80));
  const VectorField spin = vectorExpression("-y, x, min(t, 1)");
  EXPECT_EQ(spin(V3d(1, 2, 3), 0.25), V3d(-2, 1, 0.25));
  EXPECT_EQ(spin(V3d(1, 2, 3), 7), V3d(-2, 1, 1));
  EXPECT_EQ(scalarExpression("x > 0 ? 1 : -1")(V3d(-3, 0, 0)), -1);
}

TEST(Expression, ThreadsDoNotShareVariables) {
  const ScalarField field = scalarExpression("x * 3 + y");
  std::atomic<int> wrong = 0;
  tbb::parallel_for(0, 100000, [&](int i) {
    if (field(V3d(i, -i, 0)) != 2.0 * i) ++wrong;
  });
  EXPECT_EQ(wrong, 0);
}

TEST(Expression, RefusesInvalidFormulas) {
  for (const char* text : {"", "x +", "x y", "q + 1", "x, y", "system(1)", "sin(", "x = 3,"})
    EXPECT_THROW((void)scalarExpression(text), UsageError) << text;
  for (const char* text : {"x, y", "x, y, z, 1", "1", ",,"})
    EXPECT_THROW((void)vectorExpression(text), UsageError) << text;
  for (const char* text : {"", "x", "t + r", "1, 2", "t, 0, 0"})
    EXPECT_THROW((void)timeExpression(text), UsageError) << text;
}

TEST(Expression, RefusesLongFormulas) {
  const std::string sentence =
      support::refusal<UsageError>([] { (void)scalarExpression(std::string(100'000, '-') + "x"); });
  EXPECT_SAYS(sentence, "cannot be read");
  EXPECT_LT(sentence.size(), 1000u);
}

TEST(Expression, KnowsOnlyMeaningfulVariables) {
  EXPECT_EQ(timeExpression("2*t + pi")(0.5), 1 + M_PI);
  const std::string sentence =
      support::refusal<UsageError>([] { (void)scalarExpression("0.3*t"); });
  EXPECT_NE(sentence.find("use x, y, z, r, numbers"), std::string::npos) << sentence;
}

TEST(Expression, ReadsSpeedsOfASurface) {
  const NormalSpeed speed = speedExpression("nx + 2*ny - nz*k + t + r");
  EXPECT_EQ(speed.value({V3d(3, 4, 0), 10, V3d(1, 2, 3), -5}), 1 + 4 + 15 + 10 + 5);
  EXPECT_TRUE(speed.usesTime && speed.usesNormal && speed.usesCurvature);
  const NormalSpeed steady = speedExpression("x + 1"), anisotropic = speedExpression("abs(nz)"),
                    curved = speedExpression("-k");
  EXPECT_FALSE(steady.usesTime || steady.usesNormal || steady.usesCurvature);
  EXPECT_TRUE(anisotropic.usesNormal);
  EXPECT_FALSE(anisotropic.usesTime || anisotropic.usesCurvature);
  EXPECT_TRUE(curved.usesCurvature);
  EXPECT_FALSE(curved.usesTime || curved.usesNormal);
  for (const char* text : {"", "1, 2", "n", "kx + 1"})
    EXPECT_THROW((void)speedExpression(text), UsageError) << text;
}

TEST(Mask, RisesSmoothlyBetweenItsLimits) {
  Mask mask{.field = [](const V3d& p) { return p.x; }, .min = 2, .max = 4};
  EXPECT_EQ(mask.weight(V3d(1, 0, 0)), 0);
  EXPECT_EQ(mask.weight(V3d(3, 0, 0)), 0.5);
  EXPECT_EQ(mask.weight(V3d(5, 0, 0)), 1);
  mask.invert = true;
  EXPECT_EQ(mask.weight(V3d(1, 0, 0)), 1);
  EXPECT_EQ(mask.weight(V3d(NAN, 0, 0)), 1);
  mask.max = mask.min;
  EXPECT_EQ(mask.weight(V3d(1.9, 0, 0)), 1);
  EXPECT_EQ(mask.weight(V3d(2, 0, 0)), 0);
  EXPECT_THROW(checkMask({.field = mask.field, .min = 1, .max = 0}), UsageError);
  EXPECT_THROW(checkMask({.field = mask.field, .min = NAN}), UsageError);
  EXPECT_THROW(checkMask({}), UsageError);
  EXPECT_NO_THROW(checkMask(mask));
}

}  // namespace expression_test
