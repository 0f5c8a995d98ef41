// Pictures of segmentations on the command line.

#include <gtest/gtest.h>

#include <filesystem>
#include <set>
#include <string>

#include "render/images/image.h"
#include "tests/support/action_test.h"
#include "tests/support/files.h"

namespace segmented_picture_test {

class SegmentedPicture : public support::ActionTest {};

constexpr const char* kNested =
    "sphere --radius 1 --voxel 0.1 ! sphere --radius 0.6 --voxel 0.1 ! segment ";

std::set<std::uint32_t> idsIn(const std::filesystem::path& file) {
  const render::Image image = render::readExr(file);
  const auto& ids = image.ids.at("id");
  return {ids.begin(), ids.end()};
}

TEST_F(SegmentedPicture, AgreesWithTheJudgeAndHidesRegions) {
  const std::string size = " --size 48x36 --samples 1 --renderer both";
  ASSERT_EQ(levelsmith(std::string(kNested) + "! render all.exr" + size).code, 0);
  ASSERT_EQ(levelsmith(std::string(kNested) + "! render inner.exr --hide 1" + size).code, 0);
  EXPECT_EQ(idsIn(folder_ / "all.exr"), (std::set<std::uint32_t>{0, 1}));
  EXPECT_EQ(idsIn(folder_ / "inner.exr"), (std::set<std::uint32_t>{0, 2}));
}

TEST_F(SegmentedPicture, RefusesWrongLabels) {
  expectRefusal(std::string(kNested) + "! render a.png --hide 3", 3, "no region 3 to hide");
  expectRefusal(std::string(kNested) + "! render a.png --hide 1,2", 3, "leave one out");
  expectRefusal(std::string(kNested) + "! render a.png --hide x", 2, "'x' is not a label");
  expectRefusal(std::string(kNested) + "! render a.png --hide ,", 2, "no label is given");
  expectRefusal("sphere --radius 1 --voxel 0.1 ! render a.png --hide 1", 2,
                "--hide is for segmentations");
  expectRefusal(std::string(kNested) + "! render a.png --filter bspline", 2, "trilinear");
}

}  // namespace segmented_picture_test
