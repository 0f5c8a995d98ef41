#include "render/kernel/light_lattice.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace render {
namespace {

using Imath::V3d;

// Least cosine between the normals of a cell's corners, and between a sample's normal and the
// interpolated one.
constexpr double kLeastCosine = 0.94;
// Largest difference between a cell's corners of the sky's and of the key light's share.
constexpr double kSkyRange = 0.1, kKeyRange = 0.3;
// Largest distance of a sample's position from the interpolated one, as a share of the cell's size.
constexpr double kOffPlane = 0.25;

bool isSameSurface(const Hit& a, const Hit& b) {
  return a.found && b.found && a.solid == b.solid && a.primitive == b.primitive &&
         a.isOnMesh == b.isOnMesh && a.isOnGround == b.isOnGround;
}

}  // namespace

LightLattice::LightLattice(const PixelBox& box, int width, int height, int spacing)
    : spacing_(spacing), firstColumn_(box.left / spacing), firstRow_(box.top / spacing) {
  // The last lattice line lies on the edge of the picture: blocks outside the frame may be culled.
  const auto linesOf = [spacing](int first, int end, int edge) {
    std::vector<double> lines;
    for (int line = first; lines.size() < 2 || lines.back() < end; ++line)
      lines.push_back(std::min(line * spacing, edge));
    return lines;
  };
  columns_ = linesOf(firstColumn_, box.right, width);
  rows_ = linesOf(firstRow_, box.bottom, height);
  for (const double y : rows_)
    for (const double x : columns_) points_.push_back({x, y});
}

void LightLattice::setNodes(std::vector<Node> nodes) {
  nodes_ = std::move(nodes);
  cells_.clear();
  for (std::size_t row = 0; row + 1 < rows_.size(); ++row)
    for (std::size_t column = 0; column + 1 < columns_.size(); ++column)
      cells_.push_back(cellBetween(column, row));
}

LightLattice::Cell LightLattice::cellBetween(std::size_t column, std::size_t row) const {
  const std::array<const Node*, 4> corners = {
      &nodes_[nodeAt(column, row)], &nodes_[nodeAt(column + 1, row)],
      &nodes_[nodeAt(column, row + 1)], &nodes_[nodeAt(column + 1, row + 1)]};
  Cell cell;
  const auto [sky, skyTop] = std::minmax(
      {corners[0]->light.sky, corners[1]->light.sky, corners[2]->light.sky, corners[3]->light.sky});
  const auto [key, keyTop] = std::minmax(
      {corners[0]->light.key, corners[1]->light.key, corners[2]->light.key, corners[3]->light.key});
  for (std::size_t i = 0; i < 4; ++i)
    for (std::size_t j = 0; j < i; ++j) {
      const Hit &a = corners[i]->hit, &b = corners[j]->hit;
      if (!isSameSurface(a, b) || a.normal.dot(b.normal) < kLeastCosine) return cell;
      cell.size = std::max(cell.size, (a.position - b.position).length());
    }
  cell.isSmooth = true;
  cell.isSkyKnown = skyTop - sky <= kSkyRange;
  cell.isKeyKnown = keyTop - key <= kKeyRange;
  return cell;
}

LightLattice::Estimate LightLattice::at(int pixelX, int pixelY, double x, double y,
                                        const Hit& hit) const {
  if (cells_.empty()) return {};
  // The pixel selects the cell, since the position may round to the next one. So the cell does not
  // depend on the box.
  const auto column = static_cast<std::size_t>(pixelX / spacing_ - firstColumn_),
             row = static_cast<std::size_t>(pixelY / spacing_ - firstRow_);
  const Cell& cell = cells_[row * (columns_.size() - 1) + column];
  if (!cell.isSmooth || !(cell.isSkyKnown || cell.isKeyKnown)) return {};
  const auto shareOf = [](double at, double from, double to) {
    return to > from ? std::clamp((at - from) / (to - from), 0.0, 1.0) : 0;
  };
  const double right = shareOf(x, columns_[column], columns_[column + 1]),
               down = shareOf(y, rows_[row], rows_[row + 1]);
  const std::size_t first = nodeAt(column, row), second = nodeAt(column, row + 1);
  const std::array<const Node*, 4> corners = {&nodes_[first], &nodes_[first + 1], &nodes_[second],
                                              &nodes_[second + 1]};
  // Equal values at the corners give the same value in between, to the bit.
  const auto mixed = [&](const auto& of) {
    const auto top = of(*corners[0]) + (of(*corners[1]) - of(*corners[0])) * right,
               bottom = of(*corners[2]) + (of(*corners[3]) - of(*corners[2])) * right;
    return top + (bottom - top) * down;
  };
  Estimate estimate;
  estimate.light = {mixed([](const Node& node) { return node.light.sky; }),
                    mixed([](const Node& node) { return node.light.key; })};
  const V3d position = mixed([](const Node&node) { return node.hit.position; }),
            normal = mixed([](const Node&node) { return node.hit.normal; });
  if (!isSameSurface(hit, corners[0]->hit) ||
      hit.normal.dot(normal) < kLeastCosine * normal.length() ||
      std::abs((hit.position - position).dot(normal)) > kOffPlane * cell.size)
    return {};
  estimate.isSkyKnown = cell.isSkyKnown;
  estimate.isKeyKnown = cell.isKeyKnown;
  return estimate;
}

}  // namespace render
