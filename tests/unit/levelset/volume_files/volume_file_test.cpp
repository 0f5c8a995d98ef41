#include "levelset/volume_files/volume_file.h"

#include <gtest/gtest.h>
#include <zlib.h>

#include <cmath>
#include <limits>
#include <random>

#include "levelset/error.h"
#include "levelset/fields/grid_vdb.h"
#include "tests/support/files.h"
#include "tests/support/volume_files.h"

namespace volume_file_test {

using Imath::V3d;
using Imath::V3i;
using levelset::InvalidInput;
using levelset::RawLayout;
using levelset::readVolume;
using levelset::ResourceLimit;
using levelset::UsageError;
using levelset::Volume;
using levelset::VolumeType;
using support::kOblique;
using support::mrc;
using support::nifti1;
using support::nifti2;
using support::numberBytes;
using support::refusal;
using support::smallNumbers;
using support::TemporaryFolder;
using support::writeText;

/// windowBits of zlib: 31 for gzip, 15 for zlib.
std::string packed(const std::string& bytes, int window) {
  z_stream stream{};
  EXPECT_EQ(deflateInit2(&stream, 6, Z_DEFLATED, window, 8, Z_DEFAULT_STRATEGY), Z_OK);
  std::string out(bytes.size() + 1000, '\0');
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(bytes.data()));
  stream.avail_in = static_cast<uInt>(bytes.size());
  stream.next_out = reinterpret_cast<Bytef*>(out.data());
  stream.avail_out = static_cast<uInt>(out.size());
  EXPECT_EQ(deflate(&stream, Z_FINISH), Z_STREAM_END);
  out.resize(out.size() - stream.avail_out);
  deflateEnd(&stream);
  return out;
}
std::string gzip(const std::string& bytes) {
  return packed(bytes, 31);
}

void expectNumbers(const Volume& volume, const std::vector<int>& numbers) {
  ASSERT_EQ(volume.size(), V3i(3, 2, 2));
  for (int k = 0; k < 2; ++k)
    for (int j = 0; j < 2; ++j) {
      std::array<float, 3> row{};
      volume.storedRow(j, k, row);
      for (int i = 0; i < 3; ++i) {
        const int expected = numbers[static_cast<std::size_t>((k * 2 + j) * 3 + i)];
        EXPECT_EQ(volume.at(i, j, k), expected);
        EXPECT_EQ(row[static_cast<std::size_t>(i)], static_cast<float>(expected));
      }
    }
}

/// Position of a grid point by the rows of an sform.
V3d placeBy(const support::SformRows& rows, const V3d& index) {
  V3d place;
  for (int axis = 0; axis < 3; ++axis) {
    const auto& row = rows[static_cast<std::size_t>(axis)];
    place[axis] = row[0] * index.x + row[1] * index.y + row[2] * index.z + row[3];
  }
  return place;
}

void expectPlaces(const Volume& volume, const support::SformRows& rows, double tolerance) {
  for (const V3d& index : {V3d(0), V3d(2, 0, 0), V3d(0, 1, 0), V3d(0, 0, 1), V3d(2, 1, 1)}) {
    const V3d error = index * volume.grid().indexToWorld - placeBy(rows, index);
    EXPECT_LE(error.length(), tolerance) << index;
  }
}

/// A type of numbers with its names in the formats.
struct NumberType {
  int nifti;
  const char* meta;
  const char* nrrd;
  const char* raw;
  bool isSigned;
  VolumeType inMemory;
  std::string (*bytes)(const std::vector<int>&, bool);
};
const NumberType kTypes[] = {
    {2, "MET_UCHAR", "uchar", "u8", false, VolumeType::U8, numberBytes<std::uint8_t>},
    {256, "MET_CHAR", "int8", "i8", true, VolumeType::I8, numberBytes<std::int8_t>},
    {512, "MET_USHORT", "unsigned short", "u16", false, VolumeType::U16,
     numberBytes<std::uint16_t>},
    {4, "MET_SHORT", "short", "i16", true, VolumeType::I16, numberBytes<std::int16_t>},
    {768, "MET_UINT", "uint32", "u32", false, VolumeType::F32, numberBytes<std::uint32_t>},
    {8, "MET_INT", "int", "i32", true, VolumeType::F32, numberBytes<std::int32_t>},
    {16, "MET_FLOAT", "float", "f32", true, VolumeType::F32, numberBytes<float>},
    {64, "MET_DOUBLE", "double", "f64", true, VolumeType::F32, numberBytes<double>}};

// === Each format, all types, both byte orders

TEST(VolumeFiles, NiftiKeepsNumbersAndPlaces) {
  const TemporaryFolder folder;
  for (const NumberType& type : kTypes)
    for (const bool isBig : {false, true}) {
      const std::vector<int> numbers = smallNumbers(type.isSigned);
      const std::string data = type.bytes(numbers, isBig);
      SCOPED_TRACE(std::string(type.raw) + (isBig ? " big" : " little"));
      support::ByteText one = nifti1(type.nifti, 0, isBig, kOblique);
      writeText(folder / "a.nii", one.bytes + data);
      writeText(folder / "a.nii.gz", gzip(one.bytes + data));
      one.bytes.replace(344, 3, "ni1");
      one.put<float>(108, 0);
      writeText(folder / "pair.hdr", one.bytes);
      writeText(folder / "pair.img", data);
      writeText(folder / "two.nii", nifti2(type.nifti, isBig, kOblique).bytes + data);
      for (const char* file : {"a.nii", "a.nii.gz", "pair.hdr", "pair.img", "two.nii"}) {
        SCOPED_TRACE(file);
        const Volume volume = readVolume(folder / file);
        EXPECT_EQ(volume.type(), type.inMemory);
        expectNumbers(volume, numbers);
        // NIfTI-1 stores floats: 2.5 has an error of 6e-8 times the largest coordinate.
        expectPlaces(volume, kOblique, std::string(file) == "two.nii" ? 1e-14 : 1e-6);
      }
    }
}

TEST(VolumeFiles, NumbersInTheOrderOfTheMachineStayInTheFile) {
  const TemporaryFolder folder;
  writeText(folder / "a.nii", nifti1(4, 16, false, kOblique).bytes +
                                  numberBytes<std::int16_t>(smallNumbers(true), false));
  writeText(folder / "b.nii", nifti1(4, 16, true, kOblique).bytes +
                                  numberBytes<std::int16_t>(smallNumbers(true), true));
  EXPECT_TRUE(readVolume(folder / "a.nii").isMapped());
  EXPECT_FALSE(readVolume(folder / "b.nii").isMapped());
  EXPECT_EQ(readVolume(folder / "a.nii").contentHash(), readVolume(folder / "b.nii").contentHash());
}

TEST(VolumeFiles, NiftiRescalesNumbers) {
  const TemporaryFolder folder;
  support::ByteText file = nifti1(4, 16, false, kOblique);
  file.put<float>(112, 0.5f);
  file.put<float>(116, -3);
  writeText(folder / "a.nii", file.bytes + numberBytes<std::int16_t>(smallNumbers(true), false));
  const Volume volume = readVolume(folder / "a.nii");
  EXPECT_EQ(volume.at(1, 0, 0), 0.5 * -33 - 3);
  EXPECT_EQ(volume.lowest(), 0.5 * -40 - 3);
  EXPECT_EQ(volume.highest(), 0.5 * 37 - 3);
}

TEST(VolumeFiles, NiftiQformRotatesAndMirrors) {
  // A quarter turn about z, which takes i to y and j to -x, and a mirrored k axis.
  const TemporaryFolder folder;
  support::ByteText file = nifti1(2, 8, false, kOblique);
  file.put<std::int16_t>(252, 1);
  file.put<std::int16_t>(254, 0);
  file.put<float>(76, -1);
  file.put<float>(80, 2);
  file.put<float>(84, 3);
  file.put<float>(88, 4);
  file.put<float>(264, static_cast<float>(std::sqrt(0.5)));
  file.put<float>(268, 5);
  file.put<float>(272, 6);
  file.put<float>(276, 7);
  writeText(folder / "a.nii", file.bytes + numberBytes<std::uint8_t>(smallNumbers(false), false));
  const Volume volume = readVolume(folder / "a.nii");
  expectPlaces(volume, {{{0, -3, 0, 5}, {2, 0, 0, 6}, {0, 0, -4, 7}}}, 1e-6);
  EXPECT_EQ(volume.grid().orientation(), "ALI");
}

TEST(VolumeFiles, NiftiUnitsBecomeMillimetres) {
  const TemporaryFolder folder;
  support::ByteText file = nifti1(2, 8, false, {{{1, 0, 0, 2}, {0, 1, 0, 0}, {0, 0, 1, 0}}});
  file.put<std::int8_t>(123, 1);  // metres
  writeText(folder / "a.nii", file.bytes + numberBytes<std::uint8_t>(smallNumbers(false), false));
  EXPECT_EQ(V3d(1, 0, 0) * readVolume(folder / "a.nii").grid().indexToWorld, V3d(3000, 0, 0));
}

TEST(VolumeFiles, NiftiFramesAreChosen) {
  const TemporaryFolder folder;
  support::ByteText file = nifti1(2, 8, false, kOblique);
  file.put<std::int16_t>(40, 4);
  file.put<std::int16_t>(48, 2);
  std::vector<int> second = smallNumbers(false);
  for (int& number : second) ++number;
  writeText(folder / "a.nii", file.bytes + numberBytes<std::uint8_t>(smallNumbers(false), false) +
                                  numberBytes<std::uint8_t>(second, false));
  std::vector<std::string> notes;
  expectNumbers(readVolume(folder / "a.nii", {.notes = &notes}), smallNumbers(false));
  ASSERT_EQ(notes.size(), 1u);
  EXPECT_SAYS(notes[0], "--frame");
  expectNumbers(readVolume(folder / "a.nii", {.frame = 1}), second);
  EXPECT_SAYS(refusal<InvalidInput>([&] { (void)readVolume(folder / "a.nii", {.frame = 2}); }),
              "no --frame 2");
}

/// LPS coordinates of the oblique map: x and y negated.
std::string lpsVector(std::size_t column) {
  return std::to_string(-kOblique[0][column]) + "," + std::to_string(-kOblique[1][column]) + "," +
         std::to_string(kOblique[2][column]);
}

TEST(VolumeFiles, MetaImageKeepsNumbersAndTurnsLpsIntoRas) {
  const TemporaryFolder folder;
  for (const NumberType& type : kTypes)
    for (const bool isBig : {false, true}) {
      SCOPED_TRACE(std::string(type.meta) + (isBig ? " big" : " little"));
      const std::vector<int> numbers = smallNumbers(type.isSigned);
      const std::string data = type.bytes(numbers, isBig);
      std::string header = "ObjectType = Image\nNDims = 3\nDimSize = 3 2 2\n";
      header += std::string("BinaryDataByteOrderMSB = ") + (isBig ? "True" : "False") + "\n";
      // Row n of the matrix is the direction of axis n; here it has the spacing in it as well.
      header += "TransformMatrix =";
      for (std::size_t axis = 0; axis < 3; ++axis) {
        std::string vector = lpsVector(axis);
        std::replace(vector.begin(), vector.end(), ',', ' ');
        header += " " + vector;
      }
      header += "\nOffset = -10 20 30\nElementSpacing = 1 1 1\n";
      header += std::string("ElementType = ") + type.meta + "\n";
      writeText(folder / "a.mha", header + "ElementDataFile = LOCAL\n" + data);
      writeText(folder / "b.mha",
                header + "CompressedData = True\nElementDataFile = LOCAL\n" + packed(data, 15));
      writeText(folder / "c.mhd", header + "ElementDataFile = c.bin\n");
      writeText(folder / "c.bin", data);
      writeText(folder / "d.mhd", header + "HeaderSize = -1\nElementDataFile = d.bin\n");
      writeText(folder / "d.bin", "some words before the numbers" + data);
      for (const char* file : {"a.mha", "b.mha", "c.mhd", "d.mhd"}) {
        SCOPED_TRACE(file);
        const Volume volume = readVolume(folder / file);
        EXPECT_EQ(volume.type(), type.inMemory);
        expectNumbers(volume, numbers);
        expectPlaces(volume, kOblique, 1e-14);
      }
    }
}

TEST(VolumeFiles, NrrdKeepsNumbersAndTurnsLpsIntoRas) {
  const TemporaryFolder folder;
  for (const NumberType& type : kTypes)
    for (const bool isBig : {false, true}) {
      SCOPED_TRACE(std::string(type.nrrd) + (isBig ? " big" : " little"));
      const std::vector<int> numbers = smallNumbers(type.isSigned);
      const std::string data = type.bytes(numbers, isBig);
      std::string header = std::string("NRRD0004\n# a comment\ntype: ") + type.nrrd +
                           "\ndimension: 3\nspace: left-posterior-superior\nsizes: 3 2 2\n" +
                           "space directions: (" + lpsVector(0) + ") (" + lpsVector(1) + ") (" +
                           lpsVector(2) + ")\nspace origin: (" + lpsVector(3) +
                           ")\nkey:=value\nendian: " + (isBig ? "big" : "little") + "\n";
      std::string text;
      for (const int number : numbers) text += std::to_string(number) + "\n";
      writeText(folder / "a.nrrd", header + "encoding: raw\n\n" + data);
      writeText(folder / "b.nrrd", header + "encoding: gzip\n\n" + gzip(data));
      writeText(folder / "c.nrrd", header + "encoding: ascii\n\n" + text);
      writeText(folder / "d.nhdr",
                header + "encoding: raw\nline skip: 1\nbyte skip: 2\n" + "data file: d.bin\n");
      writeText(folder / "d.bin", "a line\n??" + data);
      for (const char* file : {"a.nrrd", "b.nrrd", "c.nrrd", "d.nhdr"}) {
        SCOPED_TRACE(file);
        const Volume volume = readVolume(folder / file);
        EXPECT_EQ(volume.type(), type.inMemory);
        expectNumbers(volume, numbers);
        expectPlaces(volume, kOblique, 1e-14);
      }
    }
}

TEST(VolumeFiles, RawNumbersHaveTheGivenLayout) {
  const TemporaryFolder folder;
  for (const NumberType& type : kTypes)
    for (const bool isBig : {false, true}) {
      SCOPED_TRACE(std::string(type.raw) + (isBig ? " big" : " little"));
      const std::vector<int> numbers = smallNumbers(type.isSigned);
      const RawLayout layout{.size = V3i(3, 2, 2),
                             .type = type.raw,
                             .isBigEndian = isBig,
                             .skip = 5,
                             .spacing = V3d(2, 3, 4),
                             .origin = V3d(-1, 0, 1)};
      writeText(folder / "a.raw", "12345" + type.bytes(numbers, isBig));
      writeText(folder / "a.raw.gz", gzip("12345" + type.bytes(numbers, isBig)));
      for (const char* file : {"a.raw", "a.raw.gz"}) {
        const Volume volume = readVolume(folder / file, {.raw = layout});
        EXPECT_EQ(volume.type(), type.inMemory);
        expectNumbers(volume, numbers);
        expectPlaces(volume, {{{2, 0, 0, -1}, {0, 3, 0, 0}, {0, 0, 4, 1}}}, 0);
      }
    }
}

TEST(VolumeFiles, MrcHonoursAxesOriginAndByteOrder) {
  const TemporaryFolder folder;
  struct Mode {
    int mode;
    VolumeType type;
    bool isSigned;
    std::string (*bytes)(const std::vector<int>&, bool);
  };
  const Mode modes[] = {{0, VolumeType::I8, true, numberBytes<std::int8_t>},
                        {1, VolumeType::I16, true, numberBytes<std::int16_t>},
                        {2, VolumeType::F32, true, numberBytes<float>},
                        {6, VolumeType::U16, false, numberBytes<std::uint16_t>}};
  for (const Mode& mode : modes)
    for (const bool isBig : {false, true}) {
      SCOPED_TRACE(std::to_string(mode.mode) + (isBig ? " big" : " little"));
      const std::vector<int> numbers = smallNumbers(mode.isSigned);
      support::ByteText file = mrc(mode.mode, isBig);
      file.put<std::int32_t>(92, 8);  // an extended header
      file.bytes += "extended" + mode.bytes(numbers, isBig);
      writeText(folder / "a.mrc", file.bytes);
      const Volume plain = readVolume(folder / "a.mrc");
      EXPECT_EQ(plain.type(), mode.type);
      expectNumbers(plain, numbers);
      expectPlaces(plain, {{{1.5, 0, 0, 0}, {0, 1.5, 0, 0}, {0, 0, 1.5, 0}}}, 0);

      // Columns along z, rows along x and sections along y. MX, MY and MZ are 3, 2 and 2.
      const std::array<std::int32_t, 3> order = {3, 1, 2};
      for (std::size_t n = 0; n < 3; ++n) file.put<std::int32_t>(64 + 4 * n, order[n]);
      for (std::size_t n = 0; n < 3; ++n)  // the index of the first point, without ORIGIN
        file.put<std::int32_t>(16 + 4 * n, static_cast<std::int32_t>(n + 1));
      writeText(folder / "a.map", file.bytes);
      expectPlaces(readVolume(folder / "a.map"),
                   {{{0, 1.5, 0, 3}, {0, 0, 1.5, 4.5}, {1.5, 0, 0, 1.5}}}, 0);
      for (std::size_t n = 0; n < 3; ++n) file.put<float>(196 + 4 * n, static_cast<float>(n + 7));
      writeText(folder / "a.map", file.bytes);
      expectPlaces(readVolume(folder / "a.map"), {{{0, 1.5, 0, 7}, {0, 0, 1.5, 8}, {1.5, 0, 0, 9}}},
                   0);
    }
}

TEST(VolumeFiles, MrcReadsHalfFloatsAndUnsignedBytesOfImod) {
  const TemporaryFolder folder;
  support::ByteText half = mrc(12, false);
  for (int n = 0; n < 12; ++n) half.append<std::uint16_t>(n == 0 ? 0x3c00 : 0xc500);  // 1, −5
  writeText(folder / "h.mrc", half.bytes);
  EXPECT_EQ(readVolume(folder / "h.mrc").at(0, 0, 0), 1);
  EXPECT_EQ(readVolume(folder / "h.mrc").at(1, 0, 0), -5);
  support::ByteText imod = mrc(0, false);
  imod.put<std::int32_t>(152, 1146047817);
  imod.bytes += std::string(12, '\xc8');
  writeText(folder / "i.mrc", imod.bytes);
  EXPECT_EQ(readVolume(folder / "i.mrc").at(0, 0, 0), 200);
}

TEST(VolumeFiles, FogVolumesBecomeVolumes) {
  const auto grid = openvdb::FloatGrid::create(0);
  grid->setGridClass(openvdb::GRID_FOG_VOLUME);
  grid->setTransform(openvdb::math::Transform::createLinearTransform(0.5));
  for (int n = 0; n < 3; ++n)
    grid->tree().setValue(openvdb::Coord(n, 4, -2), static_cast<float>(1 + n));
  const Volume volume = levelset::volumeOf(levelset::importField(grid));
  EXPECT_EQ(volume.size(), V3i(5, 3, 3));
  EXPECT_EQ(volume.at(1, 1, 1), 1);
  EXPECT_EQ(volume.at(3, 1, 1), 3);
  EXPECT_EQ(volume.at(0, 0, 0), 0);
  EXPECT_EQ(V3d(1, 1, 1) * volume.grid().indexToWorld, V3d(0, 2, -1));
  EXPECT_SAYS(
      refusal<ResourceLimit>([&] { (void)levelset::volumeOf(levelset::importField(grid), 100); }),
      "5 x 3 x 3");
}

// === Refusals

/// Expects that the file is refused with a message that names it and has `part`.
void expectRefused(const TemporaryFolder& folder, const std::string& name, const std::string& bytes,
                   const std::string& part, const levelset::ReadVolumeOptions& options = {}) {
  writeText(folder / name, bytes);
  const std::string sentence =
      refusal<InvalidInput>([&] { (void)readVolume(folder / name, options); });
  EXPECT_SAYS(sentence, part);
  EXPECT_SAYS(sentence, name);
  EXPECT_SAYS(sentence, "; ");  // what to do
}

TEST(VolumeFiles, TruncatedFilesAreRefused) {
  const TemporaryFolder folder;
  const std::string data = numberBytes<std::int16_t>(smallNumbers(true), false);
  const std::string shorter = data.substr(1);
  const std::string nifti = nifti1(4, 16, false, kOblique).bytes;
  expectRefused(folder, "a.nii", nifti + shorter, "has 23 bytes");
  expectRefused(folder, "a.nii", nifti.substr(0, 200), "ends inside its header");
  expectRefused(folder, "b.nii.gz", gzip(nifti + shorter), "has 23 bytes");
  // The numbers lie behind noise, so that the header is complete in half of the compressed file.
  support::ByteText far = nifti1(4, 16, false, kOblique);
  far.put<float>(108, 5000);
  std::mt19937 noise(1);
  while (far.bytes.size() < 5000) far.bytes += static_cast<char>(noise());
  const std::string whole = gzip(far.bytes + data);
  expectRefused(folder, "c.nii.gz", whole.substr(0, whole.size() / 2), "ends in the middle");
  const std::string meta =
      "NDims = 3\nDimSize = 3 2 2\nElementType = MET_SHORT\nElementDataFile = LOCAL\n";
  expectRefused(folder, "a.mha", meta + shorter, "has 23 bytes");
  expectRefused(folder, "a.mha", meta.substr(0, 30), "ElementDataFile");
  const std::string nrrd =
      "NRRD0004\ntype: short\ndimension: 3\nsizes: 3 2 2\nendian: little\nencoding: ";
  expectRefused(folder, "a.nrrd", nrrd + "raw\n\n" + shorter, "has 23 bytes");
  expectRefused(folder, "b.nrrd", nrrd + "gzip\n\n" + gzip(shorter), "has 23 bytes");
  expectRefused(folder, "c.nrrd", nrrd + "ascii\n\n1 2 3 4 5 6 7 8 9 10 11", "has 11 numbers");
  expectRefused(folder, "a.mrc", mrc(1, false).bytes + shorter, "has 23 bytes");
  expectRefused(folder, "a.mrc", mrc(1, false).bytes.substr(0, 1000), "ends inside its header");
  const RawLayout layout{.size = V3i(3, 2, 2), .type = "i16"};
  expectRefused(folder, "a.raw", shorter, "has 23 bytes", {.raw = layout});
  expectRefused(folder, "a.raw", data + "x", "has 25 bytes", {.raw = layout});
  expectRefused(folder, "a.raw.gz", gzip(data + "x"), "has 25 bytes", {.raw = layout});
}

TEST(VolumeFiles, SizesThatOverflowAreRefusedBeforeAllocation) {
  const TemporaryFolder folder;
  support::ByteText two = nifti2(2, false, kOblique);
  for (std::size_t axis = 0; axis < 3; ++axis) two.put<std::int64_t>(24 + 8 * axis, 2147483647);
  expectRefused(folder, "a.nii", two.bytes, "overflows");
  two.put<std::int64_t>(24, std::int64_t{1} << 40);
  expectRefused(folder, "a.nii", two.bytes, "must be from 1");
  two.put<std::int64_t>(24, -5);
  expectRefused(folder, "a.nii", two.bytes, "must be from 1");
  const auto nrrd = [](const std::string& sizes, const std::string& encoding) {
    return "NRRD0004\ntype: short\ndimension: 3\nsizes: " + sizes +
           "\nendian: little\nencoding: " + encoding + "\n\n";
  };
  expectRefused(folder, "b.nrrd", nrrd("2147483647 2147483647 4", "raw"), "overflows");
  // 2^40 numbers are no overflow, but do not fit the file; nothing is allocated for them.
  expectRefused(folder, "b.nrrd", nrrd("1048576 1024 1024", "raw"), "has 0 bytes");
  expectRefused(folder, "b.nrrd", nrrd("1048576 1024 1024", "ascii"), "has 0 bytes");
  writeText(folder / "c.nrrd", nrrd("1048576 1024 1024", "gzip") + gzip("1"));
  EXPECT_SAYS(refusal<ResourceLimit>([&] { (void)readVolume(folder / "c.nrrd"); }),
              "exceeds the limit");
  writeText(folder / "d.nii.gz", gzip(nifti1(2, 8, false, kOblique).bytes + std::string(12, 1)));
  EXPECT_SAYS(
      refusal<ResourceLimit>([&] { (void)readVolume(folder / "d.nii.gz", {.maxMemory = 363}); }),
      "exceeds the limit");
  EXPECT_NO_THROW((void)readVolume(folder / "d.nii.gz", {.maxMemory = 100'000}));
}

TEST(VolumeFiles, ValuesThatAreNotFiniteAreRefused) {
  const TemporaryFolder folder;
  for (const float bad :
       {std::numeric_limits<float>::quiet_NaN(), -std::numeric_limits<float>::infinity()}) {
    support::ByteText file = nifti1(16, 32, false, kOblique);
    for (int n = 0; n < 12; ++n) file.append<float>(n == 7 ? bad : 1);
    expectRefused(folder, "a.nii", file.bytes, "grid point (1, 0, 1) is not a finite number");
  }
  support::ByteText wide = nifti1(64, 64, false, kOblique);
  for (int n = 0; n < 12; ++n) wide.append<double>(n == 0 ? 1e300 : 1);
  expectRefused(folder, "b.nii", wide.bytes, "grid point (0, 0, 0) is not a finite number");
}

TEST(VolumeFiles, DamagedHeadersAreRefused) {
  const TemporaryFolder folder;
  const std::string data = numberBytes<std::uint8_t>(smallNumbers(false), false);
  const auto nifti = [&](const auto& change) {
    support::ByteText file = nifti1(2, 8, false, kOblique);
    change(file);
    return file.bytes + data;
  };
  using Bytes = support::ByteText;
  expectRefused(folder, "a.nii", nifti([](Bytes& f) { f.put<std::int32_t>(0, 7); }), "is no NIfTI");
  expectRefused(folder, "a.nii", nifti([](Bytes& f) { f.bytes[344] = 'x'; }), "ANALYZE");
  expectRefused(folder, "a.nii", nifti([](Bytes& f) { f.put<std::int16_t>(40, 9); }),
                "9 dimensions");
  expectRefused(folder, "a.nii", nifti([](Bytes& f) { f.put<std::int16_t>(70, 32); }),
                "NIfTI type 32");
  expectRefused(folder, "a.nii", nifti([](Bytes& f) { f.put<float>(108, 100); }),
                "inside its header");
  expectRefused(folder, "a.nii", nifti([](Bytes& f) { f.put<float>(108, NAN); }), "begin at byte");
  expectRefused(folder, "a.nii", nifti([](Bytes& f) { f.put<float>(280, NAN); }), "not finite");
  expectRefused(folder, "a.nii", nifti([](Bytes& f) { f.put<float>(112, NAN); }), "slope");
  expectRefused(folder, "a.nii", nifti([](Bytes& f) {
                  for (std::size_t n = 0; n < 3; ++n) f.put<float>(280 + 16 * n, 0);
                }),
                "span no space");
  expectRefused(
      folder, "a.mha",
      "NDims = 3\nDimSize = 3 2 x\nElementType = MET_UCHAR\nElementDataFile = LOCAL\n" + data,
      "DimSize");
  expectRefused(folder, "a.mha",
                "NDims = 2\nDimSize = 3 2\nElementType = MET_UCHAR\nElementDataFile = LOCAL\n",
                "NDims = '2'");
  expectRefused(folder, "a.mhd",
                "NDims = 3\nDimSize = 3 2 2\nElementType = MET_UCHAR\nElementDataFile = LIST\n",
                "several files");
  expectRefused(folder, "a.nrrd", "PNG", "NRRD000");
  expectRefused(folder, "a.nrrd", "NRRD0004\ndimension: 4\n\n", "dimension '4'");
  expectRefused(folder, "a.nrrd",
                "NRRD0004\ndimension: 3\nsizes: 3 2 2\ntype: short\nencoding: raw\n\n" + data,
                "byte order");
  expectRefused(folder, "a.nrrd",
                "NRRD0004\ndimension: 3\nsizes: 3 2 2\ntype: uchar\nencoding: ascii\n\n1 2 300 " +
                    std::string(40, '1'),
                "'300'");
  Bytes axes = mrc(0, false);
  axes.put<std::int32_t>(64, 2);
  expectRefused(folder, "a.mrc", axes.bytes + data, "MAPC, MAPR, MAPS = 2, 2, 3");
  Bytes mode = mrc(3, false);
  expectRefused(folder, "a.mrc", mode.bytes + data, "MRC mode 3");
}

TEST(VolumeFiles, OptionsThatDoNotFitAreRefused) {
  const TemporaryFolder folder;
  writeText(folder / "a.raw", "123");
  EXPECT_SAYS(refusal<UsageError>([&] { (void)readVolume(folder / "a.raw"); }), "--size");
  EXPECT_SAYS(refusal<UsageError>([&] {
                (void)readVolume(folder / "a.raw",
                                 {.raw = RawLayout{.size = V3i(1, 1, 3), .type = "u9"}});
              }),
              "no type 'u9'");
  EXPECT_SAYS(refusal<UsageError>([&] { (void)readVolume(folder / "a.png"); }), "no volume format");
  EXPECT_SAYS(refusal<levelset::IoError>([&] { (void)readVolume(folder / "none.nii"); }),
              "there is no file");
}

// === Robustness

TEST(VolumeFiles, MutatedFilesAreReadOrRefused) {
  const TemporaryFolder folder;
  const std::string data = numberBytes<float>(smallNumbers(true), false);
  const std::string meta =
      "NDims = 3\nDimSize = 3 2 2\nOffset = 1 2 3\nElementType = MET_FLOAT\nHeaderSize = 0\n"
      "TransformMatrix = 1 0 0 0 1 0 0 0 1\nElementDataFile = LOCAL\n";
  const std::string nrrd =
      "NRRD0004\ntype: float\ndimension: 3\nsizes: 3 2 2\nspace: LPS\nspace directions: (1,0,0) "
      "(0,1,0) (0,0,1)\nspace origin: (0,0,0)\nbyte skip: 0\nendian: little\nencoding: ";
  const std::pair<const char*, std::string> seeds[] = {
      {"a.nii", nifti1(16, 32, false, kOblique).bytes + data},
      {"b.nii", nifti2(16, false, kOblique).bytes + data},
      {"c.nii.gz", gzip(nifti1(16, 32, false, kOblique).bytes + data)},
      {"d.mha", meta + data},
      {"e.nrrd", nrrd + "raw\n\n" + data},
      {"f.nrrd", nrrd + "gzip\n\n" + gzip(data)},
      {"g.nrrd", nrrd + "ascii\n\n1 2 3 4 5 6 7 8 9 10 11 12\n"},
      {"h.mrc", mrc(2, false).bytes + data}};
  std::mt19937 random(1);
  std::size_t readable = 0, refused = 0;
  for (const auto& [name, seed] : seeds)
    for (int round = 0; round < 80; ++round) {
      writeText(folder / name, support::mutated(seed, random));
      try {
        const Volume volume = readVolume(folder / name, {.maxMemory = std::size_t{64} << 20});
        EXPECT_TRUE(std::isfinite(volume.lowest()) && std::isfinite(volume.highest()));
        ++readable;
      } catch (const levelset::Error& error) {
        EXPECT_TRUE(error.exitCode() == levelset::ExitCode::Input ||
                    error.exitCode() == levelset::ExitCode::Resource ||
                    error.exitCode() == levelset::ExitCode::File)
            << error.what();
        ++refused;
      }
    }
  // Both outcomes occur often, so the mutations reach the readers and their checks.
  EXPECT_GT(readable, 100u);
  EXPECT_GT(refused, 100u);
}

}  // namespace volume_file_test
