#include <gtest/gtest.h>

#include "levelset/files/band_file.h"
#include "levelset/shapes/shapes.h"
#include "levelset/vdb.h"
#include "tests/support/command_line.h"

namespace numeric_test {

class Numeric : public support::ShellTest {};

TEST_F(Numeric, FieldThatIsNoDistanceFailsTheCheck) {
  levelset::NarrowBand band = levelset::makeSphere(1, Imath::V3d(0), 0.1);
  EXPECT_NO_THROW(levelset::writeBand(folder_ / "good.vdb", band));
  for (auto it = levelset::editVdb(band).beginValueOn(); it; ++it) it.setValue(*it * 0.4f);
  levelset::writeBand(folder_ / "bad.vdb", band);
  EXPECT_EQ(levelsmith("read good.vdb ! check").code, 0);
  const auto outcome = levelsmith("read bad.vdb ! check ! write after.vdb");
  EXPECT_EQ(outcome.code, 5);
  EXPECT_NE(outcome.err.find("slope"), std::string::npos) << outcome.err;
  EXPECT_FALSE(exists("after.vdb"));
}

TEST_F(Numeric, UnreachedToleranceKeepsTheBestResultAndFails) {
  const std::string flow =
      "--report r.json sphere --radius 1 --voxel 0.1 ! curvature-flow --time 0.02 --tolerance ";
  const auto missed = levelsmith(flow + "1e-12 ! write best.vdb");
  EXPECT_EQ(missed.code, 5);
  EXPECT_NE(missed.err.find("more than the tolerance"), std::string::npos) << missed.err;
  EXPECT_NE(missed.err.find("--step"), std::string::npos) << missed.err;
  EXPECT_TRUE(exists("best.vdb"));
  EXPECT_NE(support::slurp(folder_ / "r.json").find("\"exit_code\": 5"), std::string::npos);
  EXPECT_EQ(levelsmith(flow + "0.01 ! write good.vdb").code, 0);
}

}  // namespace numeric_test
