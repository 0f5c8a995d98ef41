#include <fmt/core.h>
#include <openvdb/math/QuantizedUnitVec.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <span>
#include <utility>

#include "levelset/error.h"
#include "levelset/files/values_vdb.h"
#include "levelset/point_files/cloud_builder.h"
#include "levelset/point_files/point_grid_vdb.h"

namespace levelset::point_files {
namespace {

using openvdb::Index;

constexpr std::string_view kPointTree = "Tree_ptdataidx32_5_4_3";

bool isPoints(const VdbEntry& entry) {
  return entry.type == kPointTree;
}

std::string listOfPoints(const std::vector<VdbEntry>& entries) {
  std::string list;
  for (const VdbEntry& entry : entries)
    list += fmt::format("{}'{}' ({})", list.empty() ? "" : ", ", entry.name,
                        isPoints(entry) ? "points" : entry.type);
  return list.empty() ? "nothing" : list;
}

const VdbEntry& choosePoints(const std::vector<VdbEntry>& entries, const std::string& wanted,
                             const std::string& file) {
  const VdbEntry* chosen = nullptr;
  for (const VdbEntry& entry : entries) {
    if (!isPoints(entry) || (!wanted.empty() && entry.name != wanted)) continue;
    if (chosen)
      throw InvalidInput(
          fmt::format("{} holds more than one grid of points{}: {}; {}", file,
                      wanted.empty() ? "" : " of that name", listOfPoints(entries),
                      wanted.empty() ? "choose one with --grid" : "write them to separate files"));
    chosen = &entry;
  }
  if (!chosen)
    throw InvalidInput(
        fmt::format("{} holds {}, but no grid of points{}; {}", file, listOfPoints(entries),
                    wanted.empty() ? "" : fmt::format(" '{}'", wanted),
                    wanted.empty() ? "read another file, or this one without --points"
                                   : "choose another one with --grid"));
  return *chosen;
}

// Names of attributes, as Houdini and OpenVDB's tools use them.
constexpr std::string_view kPosition[] = {"P"}, kNormal[] = {"N"}, kColor[] = {"Cd"},
                           kAlpha[] = {"Alpha"}, kRadius[] = {"pscale", "radius"},
                           kWeight[] = {"weight", "confidence"};

// === Codecs

/// Format of the numbers of an attribute in a file.
struct NumberFormat {
  std::size_t bytes = 0;  ///< size of a number; 0: unsupported
  double (*decode)(const char*) = nullptr;
  bool isUnitVector = false;
  double error = 0;  ///< largest error of a position, voxels
};

template <typename T>
double plainNumber(const char* data) {
  T value;
  std::memcpy(&value, data, sizeof value);
  return static_cast<double>(value);
}
double halfNumber(const char* data) {
  openvdb::math::half value;
  std::memcpy(&value, data, sizeof value);
  return static_cast<double>(static_cast<float>(value));
}
template <typename T, int kShifted>
double fixedNumber(const char* data) {
  return plainNumber<T>(data) / std::numeric_limits<T>::max() - 0.5 * kShifted;
}

// OpenVDB rounds down to fixed-point numbers, so their error is a whole step.
NumberFormat formatOf(const PointAttribute& attribute, bool isVector) {
  const bool isFloat = attribute.type == (isVector ? "vec3s" : "float");
  if (attribute.codec == "null") {
    if (isFloat) return {4, plainNumber<float>, false, 0x1p-26};
    if (attribute.type == (isVector ? "vec3d" : "double")) return {8, plainNumber<double>};
    return {};
  }
  if (!isFloat) return {};
  if (attribute.codec == "trnc") return {2, halfNumber, false, 0x1p-13};
  if (attribute.codec == "fxpt8") return {1, fixedNumber<std::uint8_t, 1>, false, 1.0 / 0xff};
  if (attribute.codec == "fxpt16") return {2, fixedNumber<std::uint16_t, 1>, false, 1.0 / 0xffff};
  if (attribute.codec == "ufxpt8") return {1, fixedNumber<std::uint8_t, 0>};
  if (attribute.codec == "ufxpt16") return {2, fixedNumber<std::uint16_t, 0>};
  if (attribute.codec == "uvec" && isVector) return {2, nullptr, true};
  return {};
}

Imath::V3d vectorAt(const char* data, const NumberFormat& format) {
  if (format.isUnitVector) {
    std::uint16_t packed = 0;
    std::memcpy(&packed, data, sizeof packed);
    const openvdb::Vec3s v = openvdb::math::QuantizedUnitVec::unpack(packed);
    return {static_cast<double>(v[0]), static_cast<double>(v[1]), static_cast<double>(v[2])};
  }
  return {format.decode(data), format.decode(data + format.bytes),
          format.decode(data + 2 * format.bytes)};
}

std::size_t findAttribute(const PointDescriptor& descriptor,
                          std::span<const std::string_view> names) {
  for (const std::string_view name : names)
    for (std::size_t i = 0; i < descriptor.attributes.size(); ++i)
      if (descriptor.attributes[i].name == name) return i;
  return std::string::npos;
}

/// Reads the points of a grid into a cloud.
class CloudReader {
 public:
  CloudReader(VdbBytes& bytes, const VdbEntry& entry, CloudBuilder& builder)
      : bytes_(bytes),
        entry_(entry),
        builder_(builder),
        grid_(bytes, entry, [&builder](double more) { builder.requireMore(more); }) {}

  void read() {
    readPositions();
    if (builder_.wantsAttributes()) {
      readAttribute(kNormal, true,
                    [&](const Imath::V3d& v, FilePosition p) { builder_.addNormal(v, p); });
      std::vector<float> alphas;
      if (!presentAttributes().colors.empty())
        readAttribute(kAlpha, false, [&](const Imath::V3d& v, FilePosition) {
          alphas.push_back(static_cast<float>(v.x));
        });
      std::size_t next = 0;
      readAttribute(kColor, true, [&](const Imath::V3d& v, FilePosition p) {
        const float alpha = alphas.empty() ? 1 : alphas[next++];
        builder_.addColor(Imath::V4f(static_cast<float>(v.x), static_cast<float>(v.y),
                                     static_cast<float>(v.z), alpha),
                          p);
      });
      readAttribute(kRadius, false,
                    [&](const Imath::V3d& v, FilePosition p) { builder_.addRadius(v.x, p); });
      readAttribute(kWeight, false,
                    [&](const Imath::V3d& v, FilePosition p) { builder_.addWeight(v.x, p); });
      noteOthers();
    }
  }

 private:
  void readPositions() {
    std::uint64_t count = 0;
    double error = 0;
    for (const PointLeaf& leaf : grid_.leaves()) {
      const std::size_t n = findAttribute(*leaf.descriptor, kPosition);
      if (n == std::string::npos)
        failFile(builder_.name(),
                 fmt::format("has points without positions (P) in grid '{}'; export it again",
                             entry_.name));
      const PointAttribute& attribute = leaf.descriptor->attributes[n];
      const NumberFormat format = formatOf(attribute, true);
      if (format.bytes == 0 || format.isUnitVector)
        failFile(builder_.name(),
                 fmt::format("has positions (P) of type {} with codec {} in grid '{}'; supported "
                             "are vec3s and vec3d; export it again",
                             attribute.type, attribute.codec, entry_.name));
      error = std::max(error, format.error);
      if (grid_.offsets(leaf).back() != leaf.arrays[n].size)
        bytes_.fail("a leaf has another number of points than its voxels");
      count += leaf.arrays[n].size;
    }
    builder_.reserve(count, presentAttributes());
    for (const PointLeaf& leaf : grid_.leaves())
      readLeaf(leaf, findAttribute(*leaf.descriptor, kPosition));
    constexpr double kWorthANote = 1e-6;
    if (error > kWorthANote)
      builder_.note(fmt::format(
          "{} stores positions as short numbers; they are rounded by up to {:.2g} along each axis",
          builder_.name(),
          error * std::max({entry_.transform->voxelSize()[0], entry_.transform->voxelSize()[1],
                            entry_.transform->voxelSize()[2]})));
  }

  /// Returns a cloud with an entry in each list that the points may fill.
  [[nodiscard]] PointCloud presentAttributes() const {
    PointCloud present;
    if (!builder_.wantsAttributes()) return present;
    for (const auto& descriptor : grid_.descriptors()) {
      const auto has = [&](std::span<const std::string_view> names) {
        return findAttribute(*descriptor, names) != std::string::npos;
      };
      if (has(kNormal)) present.normals.resize(1);
      if (has(kColor)) present.colors.resize(1);
      if (has(kRadius)) present.radii.resize(1);
      if (has(kWeight)) present.weights.resize(1);
    }
    return present;
  }

  void readLeaf(const PointLeaf& leaf, std::size_t n) {
    const NumberFormat format = formatOf(leaf.descriptor->attributes[n], true);
    const auto ends = grid_.offsets(leaf);
    const PointArray& array = leaf.arrays[n];
    const auto [values, step] = grid_.values(n, array, 3 * format.bytes);
    std::uint32_t point = 0;
    for (Index voxel = 0; voxel < kPointLeafVoxels; ++voxel) {
      const openvdb::Vec3d centre =
          (leaf.origin + openvdb::FloatTree::LeafNodeType::offsetToLocalCoord(voxel)).asVec3d();
      for (; point < ends[voxel]; ++point) {
        const openvdb::Vec3d local = toVdb(vectorAt(values + point * step, format));
        builder_.addPosition(toImath(entry_.transform->indexToWorld(centre + local)), nextPoint(),
                             bytes_.rest().data());
      }
    }
  }

  /// Calls add(value, place) for each point, if all leaves have the attribute in a format that is
  /// supported.
  template <class Add>
  void readAttribute(std::span<const std::string_view> names, bool isVector, const Add& add) {
    for (const PointLeaf& leaf : grid_.leaves()) {
      const std::size_t n = findAttribute(*leaf.descriptor, names);
      if (n == std::string::npos) return;
      if (formatOf(leaf.descriptor->attributes[n], isVector).bytes == 0) return;
      if (leaf.arrays[n].stride != 1) return;
    }
    std::size_t point = 0;
    for (const PointLeaf& leaf : grid_.leaves()) {
      const std::size_t n = findAttribute(*leaf.descriptor, names);
      const NumberFormat format = formatOf(leaf.descriptor->attributes[n], isVector);
      const PointArray& array = leaf.arrays[n];
      if (array.size != leaf.arrays[findAttribute(*leaf.descriptor, kPosition)].size)
        bytes_.fail("the attributes of a leaf have different numbers of points");
      const auto [values, step] = grid_.values(
          n, array, format.isUnitVector || !isVector ? format.bytes : 3 * format.bytes);
      for (std::uint32_t i = 0; i < array.size; ++i) {
        const char* at = values + i * step;
        add(isVector ? vectorAt(at, format) : Imath::V3d(format.decode(at)),
            FilePosition{"point", ++point});
      }
    }
    for (const auto& descriptor : grid_.descriptors())
      used_.insert(descriptor->attributes[findAttribute(*descriptor, names)].name);
  }

  void noteOthers() {
    std::set<std::string> others;
    bool hasGroups = false;
    for (const auto& descriptor : grid_.descriptors()) {
      hasGroups = hasGroups || descriptor->hasGroups;
      for (const PointAttribute& a : descriptor->attributes)
        if (a.name != "P" && a.codec != "grp" && !used_.contains(a.name))
          others.insert(fmt::format("'{}' ({}, {})", a.name, a.type, a.codec));
    }
    std::string list;
    for (const std::string& other : others) list += (list.empty() ? "" : ", ") + other;
    if (!list.empty())
      builder_.note(fmt::format("{} has attributes that were left out: {}", builder_.name(), list));
    if (hasGroups)
      builder_.note(fmt::format("{} has groups of points, which were left out", builder_.name()));
  }

  [[nodiscard]] FilePosition nextPoint() const { return {"point", builder_.cloud().size() + 1}; }

  VdbBytes& bytes_;
  const VdbEntry& entry_;
  CloudBuilder& builder_;
  PointGridReader grid_;
  std::set<std::string> used_;
};

/// Returns the entry that owns the tree of `entry`: another entry when grids share a tree.
const VdbEntry& ownerOf(const std::vector<VdbEntry>& entries, const VdbEntry& entry,
                        const std::string& file) {
  if (entry.instanceOf.empty()) return entry;
  for (const VdbEntry& other : entries)
    if (other.uniqueName == entry.instanceOf && other.instanceOf.empty() && isPoints(other))
      return other;
  failFile(file, fmt::format("is damaged: the tree of grid '{}' is missing; download or create the "
                             "file again",
                             entry.name));
}

}  // namespace

void readVdbPoints(std::string_view input, CloudBuilder& builder) {
  const std::vector<VdbEntry> entries = readVdbEntries(input, builder.name());
  const VdbEntry& entry = choosePoints(entries, builder.grid(), builder.name());
  if (!entry.transform)
    throw InvalidInput(
        fmt::format("grid '{}' of {} has a frustum transform; resample it to uniform voxels first",
                    entry.name, builder.name()));
  VdbBytes bytes(input, builder.name());
  bytes.seek(ownerOf(entries, entry, builder.name()).treePosition);
  CloudReader(bytes, entry, builder).read();
}

bool vdbHoldsPoints(std::string_view input, const std::string& grid, const std::string& name) {
  bool hasPoints = false;
  for (const VdbEntry& entry : readVdbEntries(input, name)) {
    if (!grid.empty() && entry.name != grid) continue;
    if (isPoints(entry))
      hasPoints = true;
    else if (!grid.empty() ||
             entry.gridClass() == openvdb::GridBase::gridClassToString(openvdb::GRID_LEVEL_SET))
      return false;
  }
  return hasPoints;
}

}  // namespace levelset::point_files
