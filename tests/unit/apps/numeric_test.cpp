#include <gtest/gtest.h>

#include "levelset/files/band_file.h"
#include "levelset/solids/shapes.h"
#include "levelset/vdb.h"
#include "tests/support/shell.h"

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

}  // namespace numeric_test
