#include <tbb/parallel_for.h>

#include <array>
#include <vector>

#include "levelset/splines/grid_extension.h"
#include "render/embree/volume_tree_vdb.h"

namespace render {

openvdb::FloatTree::Ptr treeOf(const VolumeSurface& surface) {
  using Leaf = openvdb::FloatTree::LeafNodeType;
  using openvdb::Coord;
  constexpr int kBeyond = 2;
  const levelset::Volume& volume = surface.volume();
  const Imath::V3i size = volume.size();
  const levelset::ExtendedGrid values([&](int i, int j, int k) { return volume.at(i, j, k); },
                                      {size.x, size.y, size.z}, levelset::GridExtension::Quadratic);
  const openvdb::CoordBBox points(
      Coord(-kBeyond), Coord(size.x - 1 + kBeyond, size.y - 1 + kBeyond, size.z - 1 + kBeyond));
  std::vector<Coord> origins;
  for (int x = -8; x <= points.max().x(); x += 8)
    for (int y = -8; y <= points.max().y(); y += 8)
      for (int z = -8; z <= points.max().z(); z += 8) origins.emplace_back(x, y, z);
  std::vector<Leaf*> leaves(origins.size());
  tbb::parallel_for(std::size_t{0}, origins.size(), [&](std::size_t n) {
    leaves[n] = new Leaf(origins[n], 0.0f, true);
    for (auto value = leaves[n]->beginValueOn(); value; ++value) {
      const Coord at = value.getCoord();
      if (points.isInside(at)) value.setValue(surface.field(values(at.x(), at.y(), at.z())));
    }
  });
  openvdb::FloatTree::Ptr tree(new openvdb::FloatTree(0.0f));
  for (Leaf* leaf : leaves) tree->addLeaf(leaf);
  return tree;
}

}  // namespace render
