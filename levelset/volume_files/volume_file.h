#pragma once

#include <Imath/ImathVec.h>

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "levelset/fields/grid.h"
#include "levelset/volumes/volume.h"

/// Reads volumes: NIfTI-1 and NIfTI-2 (`.nii`, `.nii.gz`, pairs of `.hdr` and `.img`), MetaImage
/// (`.mha`, `.mhd`), NRRD (`.nrrd`, `.nhdr`), MRC (`.mrc`, `.map`) and raw numbers (`.raw`).
namespace levelset {

/// Layout of a file of raw numbers, which has no header.
struct RawLayout {
  Imath::V3i size = Imath::V3i(0);  ///< number of grid points along i (fastest), j and k
  /// Type of the numbers: u8, i8, u16, i16, u32, i32, f16, f32 or f64.
  std::string type = "u8";
  bool isBigEndian = false;
  std::size_t skip = 0;  ///< number of bytes before the first number
  Imath::V3d spacing = Imath::V3d(1), origin = Imath::V3d(0);  ///< world units
};

struct ReadVolumeOptions {
  std::string format = {};            ///< extension of the format; empty: that of the file
  std::optional<RawLayout> raw = {};  ///< layout of a raw file; needed for it, and only for it
  int frame = 0;  ///< number of the volume in a NIfTI file with several ones, from 0
  std::size_t maxMemory = kNoMemoryLimit;
  std::vector<std::string>* notes = nullptr;  ///< receives remarks about the file; may be null
  Progress progress = {};
};

/// Properties of a volume in a file, from its header.
struct VolumeFileInfo {
  std::string format;  ///< "NIfTI-1", "NIfTI-2", "MetaImage", "NRRD", "MRC" or "raw"
  VolumeGrid grid;
  std::string storedType;            ///< type of the numbers in the file
  VolumeType type = VolumeType::U8;  ///< type of the numbers in memory
  VolumeScale scale;
  std::string encoding;  ///< "raw", "gzip" or "text"
  bool isBigEndian = false;
};

/// Reads a volume. Numbers that need no decompression, no conversion and no other byte order stay
/// in the file, which is mapped into memory. 32- and 64-bit integers, half floats and doubles
/// become f32, rounded to its 24 bits.
/// @throws UsageError for a missing or superfluous layout of a raw file, or an unknown format
/// @throws IoError when a file cannot be opened
/// @throws InvalidInput when the header is damaged or unsupported, when the file is shorter than
/// its
///         header states (raw files: of another size), or when a value is not finite
/// @throws ResourceLimit before the numbers exceed options.maxMemory or the machine's memory
/// @throws Cancelled
[[nodiscard]] Volume readVolume(const std::filesystem::path& path,
                                const ReadVolumeOptions& options = {});

/// Reads only the header. @throws as readVolume
[[nodiscard]] VolumeFileInfo volumeFileInfo(const std::filesystem::path& path,
                                            const ReadVolumeOptions& options = {});

[[nodiscard]] bool isVolumeFormat(const std::filesystem::path& nameOrFormat);
/// Returns true for the name of a `.raw` file, and for "raw".
[[nodiscard]] bool isRawFormat(const std::filesystem::path& nameOrFormat);

/// Copies the active region of a grid of numbers, with a rim of one inactive value, to a volume.
/// Also for fog volumes and other grids of a .vdb file.
/// @throws InvalidInput for a grid of vectors, without an active voxel, or with a transform that is
///         not affine
/// @throws ResourceLimit before the numbers exceed `maxMemory` or the machine's memory
[[nodiscard]] Volume volumeOf(const FieldGrid& field, std::size_t maxMemory = kNoMemoryLimit);

}  // namespace levelset
