// The prism conversion and closest triangles on the command line.

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "levelset/fields/grid.h"
#include "levelset/files/band_file.h"
#include "tests/support/command_line.h"

namespace mesh_distances_command_test {

using Json = nlohmann::json;

class MeshDistances : public support::ShellTest {};

TEST_F(MeshDistances, MethodsOfALevelSetGiveTheSameBand) {
  for (const char* method : {"blocks", "prism"}) {
    const auto outcome = levelsmith(
        std::string("torus --radius 1 --tube 0.4 --voxel 0.1 ! mesh ! level-set --voxel 0.07 "
                    "--half-width 6 --method ") +
        method + " ! write " + method + ".vdb ! info --json");
    ASSERT_EQ(outcome.code, 0) << outcome.err;
  }
  EXPECT_EQ(levelset::readBand(folder_ / "blocks.vdb").contentHash(),
            levelset::readBand(folder_ / "prism.vdb").contentHash());
}

TEST_F(MeshDistances, ClosestTrianglesAreAField) {
  const std::string box =
      "box --size 1,1,1 --voxel 0.1 ! mesh --sharp ! closest-triangle --voxel 0.1 ";
  const auto index = levelsmith(box + "! write i.vdb ! info --json");
  ASSERT_EQ(index.code, 0) << index.err;
  const Json indices = Json::parse(index.out);
  EXPECT_EQ(indices["kind"], "field");
  EXPECT_EQ(indices["values"], "numbers");
  const auto vector = levelsmith(box + "--result vector ! info --json");
  ASSERT_EQ(vector.code, 0) << vector.err;
  const Json vectors = Json::parse(vector.out);
  EXPECT_EQ(vectors["values"], "vectors");
  EXPECT_EQ(vectors["active_voxels"], indices["active_voxels"]);
  EXPECT_EQ(levelsmith("--dry-run " + box).code, 0);
  EXPECT_EQ(levelsmith(box + "--half-width 0.5 ! info").code, 2);
  EXPECT_EQ(levelsmith("sphere --radius 1 --voxel 0.1 ! closest-triangle --voxel 0.1").code, 2);
}

}  // namespace mesh_distances_command_test
