#include "levelset/grids/band_blocks_vdb.h"

namespace levelset::flow {

using openvdb::Coord;
using openvdb::FloatTree;

BandBlocks::BandBlocks(const FloatTree& tree) {
  for (auto leaf = tree.cbeginLeaf(); leaf; ++leaf) {
    index_.emplace(leaf->origin(), static_cast<std::uint32_t>(origins_.size()));
    origins_.push_back(leaf->origin());
    active_.push_back(leaf->valueMask());
  }
  neighbours_.resize(size());
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, size(), 64), [&](const auto& range) {
    const openvdb::FloatGrid::ConstAccessor accessor(tree);
    for (std::size_t i = range.begin(); i != range.end(); ++i)
      for (int n = 0; n < 27; ++n) {
        const Coord c = origins_[i].offsetBy(8 * (n / 9 - 1), 8 * (n / 3 % 3 - 1), 8 * (n % 3 - 1));
        const auto found = index_.find(c);
        neighbours_[i][static_cast<std::size_t>(n)] = found != index_.end()
                                                          ? static_cast<std::int32_t>(found->second)
                                                      : accessor.getValue(c) < 0 ? kInside
                                                                                 : kOutside;
      }
  });
}

std::uint32_t BandBlocks::find(const Coord& gridPoint) const {
  const auto found = index_.find(gridPoint & ~7);
  return found == index_.end() ? kNone : found->second * 512 + LeafNode::coordToOffset(gridPoint);
}

Field BandBlocks::read(const FloatTree& tree, double unit) const {
  Field field(size());
  std::size_t i = 0;
  for (auto leaf = tree.cbeginLeaf(); leaf; ++leaf, ++i)
    for (openvdb::Index n = 0; n < 512; ++n)
      field[i][n] = static_cast<float>(static_cast<double>(leaf->getValue(n)) / unit);
  return field;
}

void BandBlocks::write(const Field& field, double unit, FloatTree& tree) const {
  std::size_t i = 0;
  for (auto leaf = tree.beginLeaf(); leaf; ++leaf, ++i) {
    float* values = leaf->buffer().data();
    for (auto it = active_[i].beginOn(); it; ++it)
      values[it.pos()] = static_cast<float>(static_cast<double>(field[i][it.pos()]) * unit);
  }
}

void BandBlocks::gather(const Field& field, std::size_t i, float outside,
                        PaddedBlock& block) const {
  block.fill([&](const Coord& step) -> BlockValues {
    const int neighbour = (step.x() + 1) * 9 + (step.y() + 1) * 3 + step.z() + 1;
    const std::int32_t n = neighbours_[i][static_cast<std::size_t>(neighbour)];
    if (n >= 0) return {field[static_cast<std::size_t>(n)].data(), 0};
    return {nullptr, n == kInside ? -outside : outside};
  });
}

}  // namespace levelset::flow
