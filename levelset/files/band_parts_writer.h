#pragma once

#include <Imath/ImathBox.h>

#include <filesystem>
#include <memory>

#include "levelset/files/band_file.h"
#include "levelset/narrow_band.h"

namespace levelset {

/// Edge length of the cells that BandPartsWriter distributes to parts, voxels: the extent of
/// OpenVDB's lower internal node.
inline constexpr int kPartCell = 128;

/// Writes a band to a `.vdb` file part by part, for bands that do not fit into memory. The values
/// wait in a temporary file beside the target. Memory: about 200 bytes for each block of 8³ grid
/// points of the complete band. The file has the bytes that writeBand() writes for the complete
/// band.
class BandPartsWriter {
 public:
  /// @param options  the format must be `.vdb`
  /// @throws IoError when the temporary file cannot be created
  /// @throws UsageError for another format
  explicit BandPartsWriter(const std::filesystem::path& path, const WriteBandOptions& options = {});
  ~BandPartsWriter();
  BandPartsWriter(const BandPartsWriter&) = delete;
  BandPartsWriter& operator=(const BandPartsWriter&) = delete;

  /// Adds the part of the band in an index box: its blocks, and its signs outside the band.
  /// @param part  a band that equals the complete band in `cells`. All parts have the same
  ///        transform and background.
  /// @param cells  lowest and highest grid point. Each face is a multiple of kPartCell, so boxes of
  ///        different parts do not overlap.
  /// @throws IoError when the values cannot be stored
  /// @throws InvalidInput when the transform or the background differs from that of earlier parts
  void add(const NarrowBand& part, const Imath::Box3i& cells);

  /// Number of active voxels that were added.
  [[nodiscard]] std::size_t activeVoxelCount() const;

  /// Writes the target. It replaces an existing file when it is complete.
  /// @throws IoError
  /// @throws InvalidInput when no part was added
  void commit();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace levelset
