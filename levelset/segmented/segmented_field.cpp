#include "levelset/segmented/segmented_field.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_reduce.h>

#include <algorithm>
#include <bit>
#include <cmath>

#include "levelset/grid_tools_vdb.h"
#include "levelset/segmented/segmented_data_vdb.h"

namespace levelset {

using Imath::V3d;
using openvdb::Coord;

bool SegmentedField::isEmpty() const {
  return !data_ || (data_->distances.empty() && (!data_->sheets || data_->sheets->edges.empty()));
}
double SegmentedField::voxelSize() const {
  return data_ ? data_->voxelSize : 0;
}
double SegmentedField::halfWidth() const {
  return data_ ? data_->halfWidth : 0;
}
std::vector<RegionLabel> SegmentedField::labels() const {
  return data_ ? data_->labels : std::vector<RegionLabel>();
}
std::vector<RegionLabel> SegmentedField::sheetLabels() const {
  return data_ && data_->sheets ? data_->sheets->owners : std::vector<RegionLabel>();
}
std::size_t SegmentedField::activeVoxelCount() const {
  return data_ ? data_->distances.size() : 0;
}
std::size_t SegmentedField::extraCount() const {
  return data_ ? data_->extras.size() : 0;
}
std::size_t SegmentedField::memoryUse() const {
  return data_ ? data_->memoryUse() : 0;
}

Imath::M44d SegmentedField::indexToWorld() const {
  Imath::M44d result;
  if (!data_) return result;
  const openvdb::math::MapBase& map = *data_->transform->baseMap();
  for (int i = 0; i < 3; ++i) {
    openvdb::Vec3d axis(0);
    axis[i] = 1;
    const openvdb::Vec3d image = map.applyJacobian(axis);
    for (int j = 0; j < 3; ++j) result[i][j] = image[j];
  }
  const openvdb::Vec3d origin = data_->transform->indexToWorld(openvdb::Vec3d(0));
  for (int j = 0; j < 3; ++j) result[3][j] = origin[j];
  return result;
}

namespace {

/// Box of the crossings of a field with sheets.
Imath::Box3d boundsOfCrossings(const SegmentedData& data) {
  Imath::Box3d box;
  const SheetData& sheets = *data.sheets;
  for (std::size_t b = 0; b < data.blockCount(); ++b) {
    const auto add = [&](std::uint16_t key, const V3d& offset) {
      const Coord at = data.blocks[b].origin + SegmentedData::localOf(key / SheetData::kSlots);
      box.extendBy(toImath(data.transform->indexToWorld(at.asVec3d() + toVdb(offset))));
    };
    for (std::size_t n = sheets.firstEdge[b]; n < sheets.firstEdge[b + 1]; ++n) {
      const Coord step = SegmentedCell::cornerOffset(sheets.edges[n] % SheetData::kSlots + 1);
      add(sheets.edges[n], V3d(step[0], step[1], step[2]) * double{sheets.positions[n]});
    }
    for (std::size_t n = sheets.firstPoint[b]; n < sheets.firstPoint[b + 1]; ++n)
      add(sheets.pointKeys[n], V3d(sheets.points[n]));
  }
  return box;
}

}  // namespace

Imath::Box3d SegmentedField::interfaceBounds() const {
  if (isEmpty()) return {};
  const SegmentedData& data = *data_;
  if (data.sheets) return boundsOfCrossings(data);
  const auto addBlock = [&](SegmentedReader& reader, const SegmentedBlock& block,
                            Imath::Box3d& box) {
    for (std::uint32_t n = 0; n < SegmentedData::kVoxels; ++n) {
      if (data.distanceIndex(block, n) < 0) continue;
      const Coord at = block.origin + SegmentedData::localOf(n);
      const SegmentedReader::Nearest a = reader.nearest(at);
      for (int axis = 0; axis < 3; ++axis) {
        Coord next = at;
        next[axis] += 1;
        const SegmentedReader::Nearest b = reader.nearest(next);
        if (a.label == b.label) continue;
        const double u = reader.distanceTo(at, a, b.label), v = reader.distanceTo(next, b, a.label);
        openvdb::Vec3d p = at.asVec3d();
        p[axis] += u + v > 0 ? u / (u + v) : 0.5;
        box.extendBy(toImath(data.transform->indexToWorld(p)));
      }
    }
  };
  return tbb::parallel_reduce(
      tbb::blocked_range<std::size_t>(0, data.blockCount(), 64), Imath::Box3d(),
      [&](const tbb::blocked_range<std::size_t>& range, Imath::Box3d box) {
        SegmentedReader reader(data);
        for (std::size_t b = range.begin(); b < range.end(); ++b)
          addBlock(reader, data.blocks[b], box);
        return box;
      },
      [](Imath::Box3d a, const Imath::Box3d& b) {
        a.extendBy(b);
        return a;
      });
}

std::uint64_t SegmentedField::contentHash() const {
  std::uint64_t hash = 0x5345474d454e5453ull;
  if (!data_) return hash;
  const Imath::M44d matrix = indexToWorld();
  hash = mixBytes(hash, matrix.getValue(), 16);
  hash = mixBytes(hash, &data_->background, 1);
  for (const SegmentedBlock& block : data_->blocks) {
    hash = mixBytes(hash, block.origin.data(), 3);
    const std::uint32_t counts[] = {block.words, block.distances, block.extras, block.palette};
    hash = mixBytes(hash, counts, 4);
  }
  hash = mixBytes(hash, data_->words.data(), data_->words.size());
  hash = mixBytes(hash, data_->distances.data(), data_->distances.size());
  hash = mixBytes(hash, data_->palettes.data(), data_->palettes.size());
  for (const SegmentedExtra& extra : data_->extras)
    hash = mixHash(hash, (std::uint64_t{extra.voxel} << 48) | (std::uint64_t{extra.label} << 32) |
                             std::bit_cast<std::uint32_t>(extra.distance));
  auto tile = data_->blockTree->cbeginValueAll();
  for (; tile; ++tile) {
    if (*tile >= 0) continue;  // already hashed
    const openvdb::CoordBBox box = tile.getBoundingBox();
    hash = mixBytes(hash, box.min().data(), 3);
    hash = mixHash(hash, static_cast<std::uint32_t>(*tile));
  }
  if (data_->sheets) hash = mixHash(hash, data_->sheets->contentHash());
  return hash;
}

struct SegmentedSampler::Impl {
  std::shared_ptr<const SegmentedData> data;
  mutable SegmentedReader reader;

  explicit Impl(std::shared_ptr<const SegmentedData> shared)
      : data(std::move(shared)), reader(*data) {}

  struct Place {
    Coord low;
    std::array<double, 8> weights;
  };
  [[nodiscard]] Place locate(const V3d& world) const {
    const openvdb::Vec3d p = data->transform->worldToIndex(toVdb(world));
    Place place{};
    std::array<double, 3> t{};
    for (int axis = 0; axis < 3; ++axis) {
      const double x = std::clamp(p[axis], -kIndexLimit, kIndexLimit), floor = std::floor(x);
      place.low[axis] = static_cast<int>(floor);
      t[static_cast<std::size_t>(axis)] = x - floor;
    }
    for (int c = 0; c < 8; ++c)
      place.weights[static_cast<std::size_t>(c)] =
          (c & 4 ? t[0] : 1 - t[0]) * (c & 2 ? t[1] : 1 - t[1]) * (c & 1 ? t[2] : 1 - t[2]);
    return place;
  }
};

SegmentedSampler::SegmentedSampler(const SegmentedField& field)
    : impl_(std::make_unique<Impl>(field.shared())) {}
SegmentedSampler::~SegmentedSampler() = default;
SegmentedSampler::SegmentedSampler(SegmentedSampler&&) noexcept = default;
SegmentedSampler& SegmentedSampler::operator=(SegmentedSampler&&) noexcept = default;

RegionLabel SegmentedSampler::label(const V3d& world) const {
  if (!std::isfinite(world.length())) return kVoid;
  const Impl::Place place = impl_->locate(world);
  const SegmentedCell cell(impl_->reader, place.low);
  if (cell.isUniform()) return cell.labels().front();
  RegionLabel best = kVoid;
  double least = INFINITY;
  for (const RegionLabel label : cell.labels()) {
    // Excess over the region of the corner: the distances on both sides of an interface then
    // balance on it, whichever other interfaces are nearer.
    double sum = 0;
    for (int c = 0; c < 8; ++c) {
      const SegmentedReader::Nearest& near = cell.corner(c);
      if (near.label == label) continue;
      sum += place.weights[static_cast<std::size_t>(c)] *
             static_cast<double>(
                 impl_->reader.distanceTo(place.low + SegmentedCell::cornerOffset(c), near, label));
    }
    if (sum > least) continue;
    least = sum;
    best = label;
  }
  return best;
}

double SegmentedSampler::signedDistance(const V3d& world, RegionLabel region) const {
  if (!std::isfinite(world.length())) return NAN;
  const Impl::Place place = impl_->locate(world);
  double sum = 0;
  for (int c = 0; c < 8; ++c) {
    const Coord at = place.low + SegmentedCell::cornerOffset(c);
    const SegmentedReader::Nearest near = impl_->reader.nearest(at);
    const float value =
        near.label == region ? -near.distance : impl_->reader.distanceTo(at, near, region);
    sum += place.weights[static_cast<std::size_t>(c)] * static_cast<double>(value);
  }
  return sum;
}

double SegmentedSampler::distance(const V3d& world) const {
  if (!std::isfinite(world.length())) return NAN;
  const Impl::Place place = impl_->locate(world);
  double sum = 0;
  for (int c = 0; c < 8; ++c)
    sum += place.weights[static_cast<std::size_t>(c)] *
           static_cast<double>(
               impl_->reader.nearest(place.low + SegmentedCell::cornerOffset(c)).distance);
  return sum;
}

}  // namespace levelset
