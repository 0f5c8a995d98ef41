#include "levelset/files/band_file.h"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <new>

#include "levelset/error.h"
#include "levelset/fields/grid_vdb.h"
#include "levelset/files/byte_io.h"
#include "levelset/files/nano_file_vdb.h"
#include "levelset/files/vdb_layout.h"
#include "levelset/files/vdb_writer.h"
#include "levelset/memory/memory_limit.h"

namespace levelset {
namespace {

namespace fs = std::filesystem;

/// Smallest voxel size of a NanoVDB file. NanoVDB's writer inverts the matrix with OpenVDB's
/// AffineMap, which treats smaller voxels as singular.
constexpr double kMinNanoVoxel = 1.5e-5;

std::string bandFormat(const fs::path& nameOrFormat) {
  std::string text = nameOrFormat.filename().string();
  text = text.substr(text.rfind('.') + 1);
  for (char& c : text)
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c | 0x20);
  return text == "vdb" || text == "nvdb" ? text : "";
}

std::string bandFormat(const fs::path& path, const std::string& given) {
  const std::string format = bandFormat(given.empty() ? path : fs::path(given));
  if (!format.empty()) return format;
  throw UsageError(fmt::format(
      "'{}' names no file format for bands; end the name in .vdb or .nvdb, or give --format",
      given.empty() ? path.string() : given));
}

// === Choice of a grid

std::string valueType(const VdbEntry& entry) {
  if (hasFloatTree(entry)) return entry.half ? "half" : "float";
  if (hasDoubleTree(entry)) return entry.half ? "double as half" : "double";
  if (hasVectorTree(entry)) {
    const std::string wide = entry.type == openvdb::Vec3DTree::treeType() ? "vec3d" : "vec3s";
    return entry.half ? wide + " as half" : wide;
  }
  return entry.type == "Tree_ptdataidx32_5_4_3" ? "points" : entry.type;
}

bool hasNumbers(const VdbEntry& entry) {
  return hasFloatTree(entry) || hasDoubleTree(entry);
}

bool isLevelSet(const VdbEntry& entry) {
  return hasNumbers(entry) &&
         entry.gridClass() == openvdb::GridBase::gridClassToString(openvdb::GRID_LEVEL_SET);
}

std::string listOf(const std::vector<VdbEntry>& entries) {
  std::string list;
  for (const VdbEntry& entry : entries)
    list += fmt::format("{}'{}' ({}, {})", list.empty() ? "" : ", ", entry.name, valueType(entry),
                        entry.gridClass());
  return list.empty() ? "nothing" : list;
}

/// Returns the grid with the name `wanted`. If `wanted` is empty, returns the only level set of the
/// file.
const VdbEntry& chooseGrid(const std::vector<VdbEntry>& entries, const std::string& wanted,
                           const std::string& file) {
  const VdbEntry* chosen = nullptr;
  for (const VdbEntry& entry : entries) {
    if (wanted.empty() ? !isLevelSet(entry) : entry.name != wanted) continue;
    if (chosen) {
      throw InvalidInput(
          fmt::format("{} holds more than one {}: {}; {}", file,
                      wanted.empty() ? "level set" : "grid of that name", listOf(entries),
                      wanted.empty() ? "choose one with --grid" : "write them to separate files"));
    }
    chosen = &entry;
  }
  if (!chosen) {
    throw InvalidInput(fmt::format(
        "{} holds {}, but no {}; {}", file, listOf(entries),
        wanted.empty() ? "level set of float values" : fmt::format("grid '{}'", wanted),
        wanted.empty()
            ? "convert it to a level set first, or name a grid with --grid to read it as "
              "a field"
            : "choose one of these with --grid"));
  }
  return *chosen;
}

/// Returns the entry that owns the tree of `entry`: another entry when grids share a tree.
const VdbEntry& treeOwner(const std::vector<VdbEntry>& entries, const VdbEntry& entry,
                          const std::string& file) {
  if (entry.instanceOf.empty()) return entry;
  for (const VdbEntry& other : entries)
    if (other.uniqueName == entry.instanceOf && other.instanceOf.empty() &&
        other.type == entry.type)
      return other;
  throw InvalidInput(
      fmt::format("{} is damaged: the tree of grid '{}' is missing; download or create "
                  "the file again",
                  file, entry.name));
}

/// A .vdb file in memory and the chosen grid.
struct ChosenGrid {
  std::string_view file;
  const std::string& name;
  const ReadBandOptions& options;
  MappedFile* mapped = nullptr;  // owner of `file` if only a region is read; else null
  std::vector<VdbEntry> entries = readVdbEntries(file, name);
  const VdbEntry& entry = chooseGrid(entries, options.grid, name);

  [[noreturn]] void refuseType(const char* readable) const {
    throw InvalidInput(
        fmt::format("grid '{}' of {} holds values of type {}; supported types are {}; convert it "
                    "first",
                    entry.name, name, valueType(entry), readable));
  }

  template <typename GridT, typename Read>
  [[nodiscard]] typename GridT::Ptr load(const Read& read, bool keepsTiles) const {
    if (!entry.transform) {
      throw InvalidInput(
          fmt::format("grid '{}' of {} has a frustum transform; resample it to "
                      "uniform voxels first",
                      entry.name, name));
    }
    const std::size_t limit = memoryLimit(options.maxMemory);
    if (!mapped || !mapped->isMapped()) requireMemory(static_cast<double>(file.size()), limit);
    VdbTreeLimits limits{.maxMemory = limit - file.size(),
                         .keepsTiles = keepsTiles,
                         .progress = subProgress(options.progress, 0.3, 0.9)};
    if (mapped) {
      if (mapped->isMapped()) limits.maxMemory = limit;
      limits.region = blocksOf(options.region, *entry.transform);
      limits.passed = [this](std::size_t end) { mapped->release(end); };
    }
    const auto grid = GridT::create(read(file, name, treeOwner(entries, entry, name), limits));
    grid->setTransform(entry.transform);
    grid->setName(entry.name);
    grid->setGridClass(openvdb::GridBase::stringToGridClass(entry.gridClass()));
    return grid;
  }

  [[nodiscard]] NarrowBand band() const {
    if (!hasNumbers(entry)) refuseType("float, half and double");
    const auto grid = load<openvdb::FloatGrid>(readVdbTree, false);
    return withContext(name, [&] { return importBand(grid, options.repairs); });
  }

  void visitBlocks(const std::function<void(const Imath::V3d&)>& visit) const {
    if (!hasNumbers(entry)) refuseType("float, half and double");
    const auto visitLeaf = [&](const openvdb::Coord& origin) {
      visit(toImath(entry.transform->indexToWorld(origin.asVec3d() + openvdb::Vec3d(3.5))));
    };
    const auto readTopology = [&](std::string_view bytes, const std::string& of,
                                  const VdbEntry& owner, VdbTreeLimits limits) {
      limits.visit = visitLeaf;
      return readVdbTree(bytes, of, owner, limits);
    };
    static_cast<void>(load<openvdb::FloatGrid>(readTopology, true));
  }

  [[nodiscard]] FieldGrid field() const {
    if (hasNumbers(entry)) {
      const auto grid = load<openvdb::FloatGrid>(readVdbTree, true);
      return withContext(name, [&] { return importField(grid); });
    }
    if (hasVectorTree(entry)) {
      const auto grid = load<openvdb::Vec3SGrid>(readVdbVectorTree, true);
      return withContext(name, [&] { return importField(grid); });
    }
    refuseType("numbers and vectors of float, half and double");
  }
};

template <typename Take>
auto readFrom(const fs::path& path, const ReadBandOptions& options, const Take& take) {
  const std::string name = inputName(path);
  if (bandFormat(path) == "nvdb") {
    throw UsageError(
        fmt::format("{} is a NanoVDB file, which can only be written; read the .vdb file with the "
                    "same grid instead",
                    name));
  }
  try {
    report(options.progress, 0);
    if (!isEverywhere(options.region)) {
      MappedFile mapped(path, options.maxMemory);
      report(options.progress, 0.3);
      auto part = take(ChosenGrid{mapped.view(), name, options, &mapped});
      report(options.progress, 1);
      return part;
    }
    const Bytes bytes = readBytes(path, options.maxMemory);
    report(options.progress, 0.3);
    auto result = take(ChosenGrid{bytes.view(), name, options});
    report(options.progress, 1);
    return result;
  } catch (const std::bad_alloc&) {
    throw ResourceLimit(
        fmt::format("{} does not fit into memory; free memory or use larger voxels", name));
  } catch (const openvdb::Exception& error) {
    throw InvalidInput(
        fmt::format("{} is damaged: {}; download or create the file again", name, error.what()));
  }
}

// === Writing

/// Copies a grid without its metadata; sets name, class and creator. The tree is shared.
template <typename GridT>
typename GridT::Ptr namedGrid(const GridT& source, const std::string& name) {
  using Tree = typename GridT::TreeType;
  const auto grid = GridT::create(openvdb::ConstPtrCast<Tree>(source.constTreePtr()));
  nameGrid(*grid, source.transform(), name, source.getGridClass());
  return grid;
}

void writeWhole(const fs::path& path, const openvdb::GridBase::ConstPtr& grid,
                const std::function<std::uint64_t()>& hash, const Progress& progress) {
  writeVdb(
      path, static_cast<double>(grid->memUsage()), [&](std::ostream& out) { writeGrid(out, grid); },
      hash, progress);
}

// === Information

template <typename T>
T metadataValue(const VdbEntry& entry, const char* key, T otherwise) {
  const VdbMetadata* found = entry.find(key);
  if (!found || found->value.size() != sizeof(T)) return otherwise;
  T value;
  std::memcpy(&value, found->value.data(), sizeof(T));
  return value;
}

/// World-space bounding box of the corners of an index box.
Imath::Box3d worldBox(const Imath::Box3d& box, const openvdb::math::Transform& transform) {
  Imath::Box3d result;
  for (int corner = 0; corner < 8; ++corner) {
    openvdb::Vec3d p;
    for (int axis = 0; axis < 3; ++axis)
      p[axis] = corner >> axis & 1 ? box.max[axis] : box.min[axis];
    result.extendBy(toImath(transform.indexToWorld(p)));
  }
  return result;
}

/// Returns the properties of a grid from its header.
/// @param owner  the entry that owns the tree of `entry`
GridInfo describe(const VdbEntry& entry, const VdbEntry& owner, std::string_view file,
                  const std::string& name) {
  using openvdb::GridBase;
  GridInfo info;
  info.name = entry.name;
  info.type = valueType(entry);
  info.gridClass = entry.gridClass();
  info.isLevelSet = isLevelSet(entry);
  const auto count = metadataValue<std::int64_t>(entry, GridBase::META_FILE_VOXEL_COUNT, 0);
  const auto bytes = metadataValue<std::int64_t>(entry, GridBase::META_FILE_MEM_BYTES, 0);
  info.activeVoxels = count > 0 ? static_cast<std::uint64_t>(count) : 0;
  info.bytes = bytes > 0 ? static_cast<std::uint64_t>(bytes) : 0;
  if (entry.transform && entry.transform->hasUniformScale())
    info.voxelSize = entry.transform->voxelSize()[0];
  using Triple = std::array<std::int32_t, 3>;
  const auto low = metadataValue<Triple>(entry, GridBase::META_FILE_BBOX_MIN, {1, 1, 1});
  const auto high = metadataValue<Triple>(entry, GridBase::META_FILE_BBOX_MAX, {0, 0, 0});
  if (low[0] <= high[0] && low[1] <= high[1] && low[2] <= high[2])
    info.indexBounds =
        Imath::Box3d(Imath::V3d(low[0], low[1], low[2]), Imath::V3d(high[0], high[1], high[2]));
  if (entry.transform && !info.indexBounds.isEmpty())
    info.worldBounds = worldBox(info.indexBounds, *entry.transform);
  if (info.isLevelSet && info.voxelSize > 0)
    info.halfWidth = readVdbBackground(file, name, owner) / info.voxelSize;
  return info;
}

}  // namespace

NarrowBand readBand(const fs::path& path, const ReadBandOptions& options) {
  return readFrom(path, options, [](const ChosenGrid& chosen) { return chosen.band(); });
}

void visitBlocks(const fs::path& path, const ReadBandOptions& options,
                 const std::function<void(const Imath::V3d&)>& visit) {
  ReadBandOptions part = options;
  part.region = Imath::Box3d(Imath::V3d(0));  // the file is mapped then, and not held in memory
  static_cast<void>(readFrom(path, part, [&](const ChosenGrid& chosen) {
    chosen.visitBlocks(visit);
    return true;
  }));
}

FieldGrid readField(const fs::path& path, const ReadBandOptions& options) {
  return readFrom(path, options, [](const ChosenGrid& chosen) { return chosen.field(); });
}

BandOrField readGrid(const fs::path& path, const ReadBandOptions& options) {
  return readFrom(path, options, [](const ChosenGrid& chosen) -> BandOrField {
    if (isLevelSet(chosen.entry)) return chosen.band();
    return chosen.field();
  });
}

void writeBand(const fs::path& path, const NarrowBand& band, const WriteBandOptions& options) {
  const std::string format = bandFormat(path, options.format);
  if (!band.shared())
    throw InvalidInput(
        fmt::format("there is no band to write to '{}'; create one first", path.string()));
  requireSolid(band);  // a file would not record that the surface is open
  if (format == "nvdb" && band.voxelSize() < kMinNanoVoxel)
    throw InvalidInput(
        fmt::format("'{}' cannot hold voxels of size {:.6g}, since NanoVDB accepts none below {}; "
                    "write a .vdb file, or use a smaller unit of length",
                    path.string(), band.voxelSize(), kMinNanoVoxel));
  const auto grid = namedGrid(vdb(band), options.name);
  grid->setGridClass(openvdb::GRID_LEVEL_SET);
  writeTarget(path, [&](const fs::path& target) {
    if (format == "vdb")
      return writeWhole(
          target, grid, [&] { return band.contentHash(); }, options.progress);
    report(options.progress, 0);
    writeNanoGrid(target, *grid);
    report(options.progress, 1);
  });
}

void writeField(const fs::path& path, const FieldGrid& field, const WriteBandOptions& options) {
  if (bandFormat(path, options.format) != "vdb") {
    throw UsageError(fmt::format(
        "'{}' cannot hold a field, since fields are written as .vdb only; end the name in .vdb",
        path.string()));
  }
  const VdbField& source = *field.shared();
  openvdb::GridBase::Ptr grid;
  if (source.scalar)
    grid = namedGrid(*source.scalar, options.name);
  else
    grid = namedGrid(*source.vector, options.name);
  writeTarget(path, [&](const fs::path& target) {
    writeWhole(
        target, grid, [&] { return field.contentHash(); }, options.progress);
  });
}

std::vector<GridInfo> bandFileInfo(const fs::path& path) {
  const std::string name = inputName(path);
  const MappedFile bytes(path);
  std::vector<GridInfo> result;
  const std::vector<VdbEntry> entries = readVdbEntries(bytes.view(), name);
  for (const VdbEntry& entry : entries)
    result.push_back(describe(entry, treeOwner(entries, entry, name), bytes.view(), name));
  return result;
}

bool isBandFormat(const fs::path& nameOrFormat) {
  return !bandFormat(nameOrFormat).empty();
}

bool isVdbFormat(const fs::path& nameOrFormat) {
  return bandFormat(nameOrFormat) == "vdb";
}

}  // namespace levelset
