#include "apps/pipeline/operators/fields.h"

#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "apps/pipeline/values/units.h"
#include "levelset/error.h"
#include "levelset/fields/grid_vdb.h"
#include "levelset/files/band_file.h"
#include "levelset/shapes/shapes.h"
#include "tests/support/command_line.h"
#include "tests/support/measured.h"

namespace fields_test {

using Imath::V3d;
using levelset::UsageError;
using pipeline::Invocation;
using pipeline::Operator;
using pipeline::ParamType;

const Operator& probe() {
  static const Operator op{
      .name = "probe",
      .group = "Test",
      .summary = "",
      .params = pipeline::withMask(
          {{.name = "speed", .type = ParamType::Scalar, .doc = ""},
           {.name = "field", .type = ParamType::Velocity, .doc = "", .choices = {"vortex"}}})};
  return op;
}

levelset::FieldGrid constantField(bool vector) {
  if (vector) {
    const auto grid = openvdb::Vec3SGrid::create(openvdb::Vec3s(1, 2, 3));
    grid->setName("wind");
    grid->setGridClass(openvdb::GRID_STAGGERED);
    grid->tree().setValue(openvdb::Coord(0), openvdb::Vec3s(1, 2, 3));
    return levelset::importField(grid);
  }
  const auto grid = openvdb::FloatGrid::create(5);
  return levelset::importField(grid);
}

TEST(Fields, AreNumbersFormulasOrValues) {
  Invocation in(probe(), {{"speed", "x + 1"}});
  EXPECT_EQ(pipeline::scalarField(in, "speed")(V3d(2, 0, 0)), 3);
  Invocation number(probe(), {{"speed", "0.5"}});
  EXPECT_EQ(pipeline::scalarField(number, "speed")(V3d(2, 0, 0)), 0.5);

  Invocation named(probe(), {{"speed", "@s"}, {"field", "@v"}});
  named.named.emplace("speed", pipeline::Value(constantField(false)));
  named.named.emplace("field", pipeline::Value(constantField(true)));
  EXPECT_EQ(pipeline::scalarField(named, "speed")(V3d(2, 0, 0)), 5);
  EXPECT_EQ(pipeline::vectorField(named, "field")(V3d(2, 0, 0), 1), V3d(1, 2, 3));

  Invocation band(probe(), {{"speed", "@b"}});
  band.named.emplace("speed", pipeline::Value(levelset::makeSphere(1, V3d(0), 0.1)));
  EXPECT_NEAR(pipeline::scalarField(band, "speed")(V3d(1.1, 0, 0)), 0.1,
              support::measured(1.49e-9));
}

TEST(Fields, InvalidOnesAreRefused) {
  const auto check = [](const char* param, const char* text) {
    pipeline::checkText(*probe().find(param), text, "probe");
  };
  EXPECT_NO_THROW(check("speed", "2*x"));
  EXPECT_NO_THROW(check("field", "vortex"));
  EXPECT_NO_THROW(check("field", "@v"));
  EXPECT_THROW(check("speed", "x, y"), UsageError);
  EXPECT_THROW(check("speed", "@"), UsageError);
  EXPECT_THROW(check("field", "spiral"), UsageError);
  Invocation swapped(probe(), {{"speed", "@v"}});
  swapped.named.emplace("speed", pipeline::Value(constantField(true)));
  EXPECT_THROW((void)pipeline::scalarField(swapped, "speed"), levelset::InvalidInput);
}

TEST(Fields, MakeMasks) {
  EXPECT_FALSE(pipeline::maskOf(Invocation(probe(), {})));
  const auto mask =
      pipeline::maskOf(Invocation(probe(), {{"mask", "x"}, {"mask-min", "1"}, {"mask-max", "3"}}));
  ASSERT_TRUE(mask);
  EXPECT_EQ(mask->weight(V3d(1, 0, 0)), 0);
  EXPECT_EQ(mask->weight(V3d(2, 0, 0)), 0.5);
  EXPECT_EQ(mask->weight(V3d(3, 0, 0)), 1);
  EXPECT_THROW((void)pipeline::maskOf(Invocation(probe(), {{"mask-min", "1"}})), UsageError);
  EXPECT_THROW((void)pipeline::maskOf(Invocation(probe(), {{"mask", "x"}, {"mask-min", "7"}})),
               UsageError);
}

class FieldCommand : public support::ShellTest {};

TEST_F(FieldCommand, ReadsReportsAndWritesFields) {
  levelset::writeField(folder_ / "wind.vdb", constantField(true), {.name = "wind"});
  const auto info = levelsmith("read wind.vdb --grid wind ! write again.vdb ! info --json");
  EXPECT_EQ(info.code, 0) << info.err;
  const auto json = nlohmann::json::parse(info.out);
  EXPECT_EQ(json["kind"], "field");
  EXPECT_EQ(json["values"], "vectors");
  EXPECT_EQ(json["class"], "staggered");
  EXPECT_EQ(json["voxel_size"], 1);
  EXPECT_EQ(levelset::readField(folder_ / "again.vdb", {.grid = "wind"}).contentHash(),
            constantField(true).contentHash());
  EXPECT_EQ(levelsmith("--dry-run read wind.vdb --grid wind ! write b.vdb").code, 0);
  EXPECT_REFUSED(levelsmith("read wind.vdb"), 3, "name a grid with --grid");
  EXPECT_REFUSED(levelsmith("read wind.vdb --grid wind ! measure"), 2, "is a field");
  EXPECT_REFUSED(levelsmith("read wind.vdb --grid wind ! write a.ply"), 2, "write .vdb");
}

TEST_F(FieldCommand, ExtendsVectorsOffTheSurface) {
  const auto outcome = levelsmith(
      "sphere --radius 1 --voxel 0.1 --as ball ! closest-point --half-width 3 --as feet ! sweep "
      "@ball "
      "--extend @feet --to 4vx ! info --json");
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_EQ(nlohmann::json::parse(outcome.out)["values"], "vectors");
}

TEST_F(FieldCommand, ReportsWhereAnAttributeIsNotFinite) {
  const auto outcome = levelsmith("sphere --radius 1 --voxel 0.1 ! sweep --extend \"1/x\"");
  EXPECT_REFUSED(outcome, 3, "fast-sweeping: --extend: '1/x' is");
  EXPECT_NE(outcome.err.find("on the surface at 0,"), std::string::npos) << outcome.err;
}

TEST_F(FieldCommand, CountsGridPointsTheFrontArrivesAt) {
  for (const char* front : {"march", "sweep --speed 1"}) {
    ASSERT_EQ(levelsmith(std::string("--report r.json sphere --radius 1 --voxel 0.1 ! ") + front +
                         " --to 1vx ! info --json > info.json")
                  .code,
              0);
    const auto report = nlohmann::json::parse(support::slurp(folder_ / "r.json"));
    const auto info = nlohmann::json::parse(support::slurp(folder_ / "info.json"));
    EXPECT_EQ(report["steps"][1]["details"]["reached"], info["active_voxels"]) << front;
  }
}

TEST_F(FieldCommand, CountsGridPointsThatFallBackToFirstOrder) {
  for (const std::string front : {"march", "sweep"})
    for (const std::string order : {"1", "2"}) {
      ASSERT_EQ(levelsmith("--report r.json sphere --radius 1 --voxel 0.1 ! " + front +
                           " --from 0.02,-0.03,0.01 --to 1.5 --order " + order)
                    .code,
                0);
      const auto report = nlohmann::json::parse(support::slurp(folder_ / "r.json"));
      const auto& details = report["steps"][1]["details"];
      const double reached = details["reached"], fellBack = details["first_order"];
      // Six layers of the ball, less the initial values.
      if (order == "1")
        EXPECT_EQ(fellBack, 0) << front;
      else
        EXPECT_NEAR(fellBack / reached, 0.2, support::measured(0.00219)) << front;
    }
}

}  // namespace fields_test
