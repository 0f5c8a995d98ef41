#include <gtest/gtest.h>

#include <random>

#include "levelset/grids/box_mask_vdb.h"

namespace box_mask_test {

using openvdb::Coord;
using openvdb::CoordBBox;

/// The grid points of the boxes, set one by one.
openvdb::MaskTree pointByPoint(const std::vector<CoordBBox>& boxes) {
  openvdb::MaskTree points;
  for (const CoordBBox& box : boxes)
    for (auto point = box.begin(); point; ++point) points.setValueOn(*point);
  return points;
}

openvdb::MaskTree byBoxes(const std::vector<CoordBBox>& boxes) {
  openvdb::MaskTree points;
  for (const CoordBBox& box : boxes) levelset::addBox(points, box);
  return points;
}

/// Active points in only one of the trees.
openvdb::Index64 differences(openvdb::MaskTree a, const openvdb::MaskTree& b) {
  openvdb::MaskTree onlyB(b);
  onlyB.topologyDifference(a);
  a.topologyDifference(b);
  return a.activeVoxelCount() + onlyB.activeVoxelCount();
}

TEST(BoxMask, SetsExactlyThePointsOfABox) {
  const std::vector<CoordBBox> boxes = {
      {Coord(0), Coord(7)},                    // a leaf
      {Coord(3, 5, 6), Coord(3, 5, 6)},        // a point
      {Coord(7), Coord(8)},                    // a corner of eight leaves
      {Coord(0, 0, 7), Coord(20, 0, 7)},       // rows along each axis, on the last point of a leaf
      {Coord(7, -9, 0), Coord(7, 16, 0)},      //
      {Coord(1, 7, -17), Coord(1, 7, 15)},     //
      {Coord(-8), Coord(-1)},                  // the leaf on the negative side of the origin
      {Coord(-13, -2, -9), Coord(4, 11, -8)},  //
      {Coord(4090, 4095, -4097), Coord(4099, 4096, -4095)},  // a border of upper nodes
  };
  for (const CoordBBox& box : boxes) {
    SCOPED_TRACE(box);
    const openvdb::MaskTree points = byBoxes({box});
    EXPECT_EQ(points.activeVoxelCount(), box.volume());
    EXPECT_EQ(differences(points, pointByPoint({box})), 0u);
  }
}

TEST(BoxMask, JoinsBoxesThatOverlap) {
  std::mt19937 random(7);
  const auto coordinate = [&](int low, int high) {
    return std::uniform_int_distribution<int>(low, high)(random);
  };
  std::vector<CoordBBox> boxes;
  for (int i = 0; i < 200; ++i) {
    const Coord low(coordinate(-30, 30), coordinate(-30, 30), coordinate(-30, 30));
    boxes.emplace_back(low, low.offsetBy(coordinate(0, 12), coordinate(0, 12), coordinate(0, 12)));
  }
  const openvdb::MaskTree points = byBoxes(boxes);
  EXPECT_EQ(differences(points, pointByPoint(boxes)), 0u);
  openvdb::Index64 volumes = 0;
  for (const CoordBBox& box : boxes) volumes += box.volume();
  EXPECT_LT(points.activeVoxelCount(), volumes);
}

TEST(BoxMask, SetsExactlyThePointsOfABall) {
  for (const double radius : {0.0, 1.0, 1.5, 5.0, 9.3}) {
    SCOPED_TRACE(radius);
    const Coord centre(-3, 6, 8);
    openvdb::MaskTree points, wanted;
    levelset::addBall(points, centre, radius);
    for (const Coord& c : CoordBBox(centre.offsetBy(-10), centre.offsetBy(10)))
      if ((c - centre).asVec3d().lengthSqr() <= radius * radius) wanted.setValueOn(c);
    EXPECT_EQ(differences(points, wanted), 0u);
  }
}

}  // namespace box_mask_test
