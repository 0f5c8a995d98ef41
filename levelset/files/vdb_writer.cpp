#include "levelset/files/vdb_writer.h"

#include <fmt/core.h>
#include <openvdb/io/GridDescriptor.h>

#include <algorithm>
#include <cerrno>
#include <fstream>
#include <memory>
#include <ostream>
#include <system_error>
#include <vector>

#include "levelset/error.h"
#include "levelset/file_target.h"

namespace levelset {
namespace {

namespace fs = std::filesystem;

/// Byte offset of the random identifier (UUID) in a .vdb file. It follows the magic number, three
/// version numbers and a flag.
constexpr std::streamoff kIdentifierOffset = 8 + 3 * 4 + 1;

/// A file buffer that reports the bytes written as a fraction of the expected bytes.
class ReportingFile : public std::filebuf {
 public:
  ReportingFile(const Progress& progress, double expected)
      : progress_(progress), expected_(expected) {}

 protected:
  std::streamsize xsputn(const char* data, std::streamsize size) override {
    constexpr double kStep = 1 << 20;
    written_ += static_cast<double>(size);
    if (written_ > told_ + kStep) {
      told_ = written_;
      // Compressed data takes fewer bytes than expected. writeVdb() reports the end after it closes
      // the file.
      report(progress_, std::min(0.9, written_ / expected_));
    }
    return std::filebuf::xsputn(data, size);
  }

 private:
  const Progress& progress_;
  double expected_, written_ = 0, told_ = 0;
};

/// OpenVDB's writer for any seekable stream. It stores the byte offsets of the grids.
struct StreamArchive : openvdb::io::Archive {
  void writeAll(std::ostream& out, const openvdb::GridBase::ConstPtr& grid) const {
    Archive::write(out, openvdb::GridCPtrVec{grid}, true, openvdb::MetaMap());
  }

  /// The steps of Archive::write(), without the statistics in the metadata.
  /// @param write  calls writeInSteps() for each grid
  void writeFile(std::ostream& out, std::int32_t count, const std::function<void()>& write) const {
    auto metadata = std::make_shared<openvdb::io::StreamMetadata>();
    openvdb::io::setStreamMetadataPtr(out, metadata, true);
    writeHeader(out, true);
    openvdb::MetaMap().writeMeta(out);
    out.write(reinterpret_cast<const char*>(&count), sizeof count);
    write();
  }

  void writeInSteps(std::ostream& out, const openvdb::GridBase& grid) const {
    openvdb::io::GridDescriptor descriptor(grid.getName(), grid.type(), grid.saveFloatAsHalf());
    descriptor.writeHeader(out);
    const std::streampos offsets = out.tellp();
    descriptor.writeStreamPos(out);
    descriptor.setGridPos(out.tellp());
    setGridCompression(out, grid);
    grid.writeMeta(out);
    grid.writeTransform(out);
    grid.writeTopology(out);
    descriptor.setBlockPos(out.tellp());
    grid.writeBuffers(out);
    descriptor.setEndPos(out.tellp());
    out.seekp(offsets);
    descriptor.writeStreamPos(out);
    descriptor.seekToEnd(out);
  }
};

std::string identifierText(std::uint64_t hash) {
  const std::uint64_t other = hash * 0x9E3779B97F4A7C15ull;
  return fmt::format("{:08X}-{:04X}-{:04X}-{:04X}-{:012X}", hash >> 32, (hash >> 16) & 0xFFFF,
                     hash & 0xFFFF, other >> 48, other & 0xFFFFFFFFFFFFull);
}

}  // namespace

void nameGrid(openvdb::GridBase& grid, const openvdb::math::Transform& transform,
              const std::string& name, openvdb::GridClass gridClass) {
  grid.setTransform(transform.copy());
  grid.setName(name);
  grid.setGridClass(gridClass);
  grid.setCreator("Levelsmith");
}

void writeGrid(std::ostream& out, const openvdb::GridBase::ConstPtr& grid) {
  StreamArchive().writeAll(out, grid);
}

void writeGridWithItsMetadata(std::ostream& out, const openvdb::GridBase& grid) {
  const StreamArchive archive;
  archive.writeFile(out, 1, [&] { archive.writeInSteps(out, grid); });
}

void writeGridsInTurn(std::ostream& out, std::int32_t count,
                      const std::function<openvdb::GridBase::Ptr(std::int32_t)>& make) {
  const StreamArchive archive;
  archive.writeFile(out, count, [&] {
    for (std::int32_t n = 0; n < count; ++n) {
      const openvdb::GridBase::Ptr grid = make(n);
      grid->addStatsMetadata();
      archive.writeInSteps(out, *grid);
    }
  });
}

std::uint32_t vdbCompression() {
  return StreamArchive().compression();
}

void writeVdb(const fs::path& path, double bytes, const std::function<void(std::ostream&)>& write,
              const std::function<std::uint64_t()>& hash, const Progress& progress) {
  openvdb::initialize();
  report(progress, 0);
  std::vector<char> buffer(1 << 20);
  ReportingFile file(progress, bytes);
  file.pubsetbuf(buffer.data(), static_cast<std::streamsize>(buffer.size()));
  std::ostream out(&file);
  out.exceptions(std::ios::badbit | std::ios::failbit);
  if (!file.open(path, std::ios::out | std::ios::binary)) out.setstate(std::ios::failbit);
  write(out);
  out.seekp(kIdentifierOffset);
  const std::string identifier = identifierText(hash());
  out.write(identifier.data(), static_cast<std::streamsize>(identifier.size()));
  if (!file.close()) out.setstate(std::ios::failbit);
  report(progress, 1);
}

void writeTarget(const fs::path& path, const std::function<void(const fs::path&)>& write) {
  FileTarget target(path);
  try {
    errno = 0;
    write(target.path());
  } catch (const std::ios_base::failure&) {
    throw IoError(
        fmt::format("'{}' could not be written: {}; free disk space or write to another disk",
                    path.string(), std::generic_category().message(errno != 0 ? errno : EIO)));
  } catch (const openvdb::Exception& error) {
    throw IoError(fmt::format("'{}' could not be written: {}; write to another file", path.string(),
                              error.what()));
  }
  target.commit();
}

}  // namespace levelset
