#include <fmt/core.h>

#include <algorithm>
#include <limits>

#include "levelset/error.h"
#include "levelset/geometry/position_table.h"
#include "levelset/mesh_files/mesh_parts.h"

// StereoLithography Interface Specification: 3D Systems, 1989.

namespace levelset {
namespace {

constexpr std::size_t kStlHeaderSize = 84, kFacetSize = 50;

/// Merges corners at equal positions into one vertex.
class VertexMerger {
 public:
  explicit VertexMerger(MeshBuilder& builder) : builder_(builder), table_(points_, 1 << 11) {}

  std::uint64_t add(const Imath::V3d& stored, FilePosition place, const char* at) {
    const Imath::V3d p = stored + Imath::V3d(0);  // −0 + 0 = 0
    if (points_.size() >= std::numeric_limits<std::uint32_t>::max())
      failFile(builder_.name(), "holds more than 4294967294 vertices; split the mesh");
    const auto next = static_cast<std::uint32_t>(points_.size());
    const std::uint32_t found = table_.findOrInsert(p, next);
    if (found == next) {
      builder_.addVertex(p.x, p.y, p.z, place, at);
      points_.push_back(p);
    }
    return found;
  }

 private:
  MeshBuilder& builder_;
  std::vector<Imath::V3d> points_;
  convert::PositionTable table_;
};

std::uint32_t facetCount(std::string_view input) {
  std::uint32_t count = 0;
  std::memcpy(&count, input.data() + 80, sizeof count);
  return count;
}

bool beginsWithSolid(std::string_view input) {
  const std::size_t begin = input.find_first_not_of(" \t\r\n\xEF\xBB\xBF");
  if (begin == std::string_view::npos) return false;
  constexpr std::string_view kSolid = "solid";
  const std::string_view word = input.substr(begin, kSolid.size());
  return std::equal(word.begin(), word.end(), kSolid.begin(), kSolid.end(),
                    [](char a, char b) { return (a | 0x20) == b; });
}

/// A binary header may also begin with "solid", so the size of the file decides first.
bool isBinary(std::string_view input, std::size_t fileSize) {
  if (input.size() >= kStlHeaderSize &&
      fileSize == kStlHeaderSize + std::size_t{facetCount(input)} * kFacetSize)
    return true;
  return !beginsWithSolid(input) || input.substr(0, 1024).find('\0') != std::string_view::npos;
}

/// Number of triangles that a file of `fileSize` bytes can hold. Refuses a header that promises
/// more.
std::size_t facetCapacity(std::string_view head, std::size_t fileSize, const std::string& name) {
  if (fileSize < kStlHeaderSize)
    failFile(name,
             "is neither text that begins with 'solid' nor long enough for a binary "
             "STL; give its actual format");
  const std::size_t count = facetCount(head), held = (fileSize - kStlHeaderSize) / kFacetSize;
  if (count > held) {
    failFile(name,
             fmt::format(
                 "promises {} triangles but can hold only {}; it is truncated or not an STL file: "
                 "download or export it again",
                 count, held));
  }
  return held;
}

void readBinary(std::string_view input, MeshBuilder& builder) {
  const std::size_t held = facetCapacity(input, input.size(), builder.name());
  const std::size_t count = facetCount(input);
  requireNoTrailingData(
      input, kStlHeaderSize + count * kFacetSize, builder.name(),
      fmt::format("the {} triangles that its header promises (the file can hold {})", count, held));
  builder.declarePrecision(CoordinatePrecision::Float);
  builder.reserve(count / 2, count);
  VertexMerger merger(builder);
  std::array<std::uint64_t, 3> corners{};
  for (std::size_t i = 0; i < count; ++i) {
    const char* facet = input.data() + kStlHeaderSize + i * kFacetSize;
    float numbers[9];
    std::memcpy(numbers, facet + 12, sizeof numbers);  // after the normal
    const FilePosition place{"triangle", i};
    for (std::size_t k = 0; k < 3; ++k)
      corners[k] =
          merger.add({numbers[3 * k], numbers[3 * k + 1], numbers[3 * k + 2]}, place, facet);
    builder.addFace(corners, place, facet);
  }
}

class TextReader {
 public:
  TextReader(std::string_view input, MeshBuilder& builder)
      : cursor_(input, builder.name()), builder_(builder), merger_(builder) {}

  void read() {
    bool open = false;
    while (cursor_.skipToToken(0)) {
      const std::string keyword = lowerToken();
      if (keyword == "vertex") {
        readVertex();
        continue;
      }
      if (keyword == "endloop") {
        builder_.addFace(corners_, cursor_.place(), cursor_.at());
        corners_.clear();
        continue;
      }
      if (keyword == "outer") {
        corners_.clear();
        cursor_.skipBlanks(0);
        static_cast<void>(cursor_.token());
        continue;
      }
      if (keyword == "endfacet") continue;
      if (keyword == "facet") {
        readNormal();
        continue;
      }
      if (keyword != "solid" && keyword != "endsolid")
        cursor_.fail(
            fmt::format("'{}' is not a keyword of an STL file; export the mesh again", keyword));
      open = keyword == "solid";
      cursor_.skipLine();  // skips the name of the solid
    }
    if (open)
      cursor_.fail("the file ends before 'endsolid'; it is truncated: download or export it again");
  }

 private:
  std::string lowerToken() {
    std::string word(cursor_.token().substr(0, 24));
    if (word.empty())
      cursor_.fail("found a backslash where a word is expected; export the mesh again");
    for (char& c : word)
      if (c >= 'A' && c <= 'Z') c = static_cast<char>(c | 0x20);
    return word;
  }

  /// Skips the word `normal` and its three numbers. The normal follows from the corners and is
  /// neither needed nor checked.
  void readNormal() {
    for (int i = 0; i < 4; ++i) {
      cursor_.skipToToken(0);
      if (cursor_.token().empty())
        cursor_.fail("the file ends within a facet; it is truncated: download or export it again");
    }
  }

  void readVertex() {
    Imath::V3d p;
    for (int axis = 0; axis < 3; ++axis) {
      cursor_.skipToToken(0);
      p[axis] = cursor_.number("a coordinate");
    }
    corners_.push_back(merger_.add(p, cursor_.place(), cursor_.at()));
  }

  TextCursor cursor_;
  MeshBuilder& builder_;
  VertexMerger merger_;
  std::vector<std::uint64_t> corners_;
};

/// Maximum spacing of single-precision coordinates, relative to the object's longest side.
constexpr double kStlPrecision = 1e-3;

void requireSinglePrecision(const TriMesh& mesh) {
  if (mesh.precision == CoordinatePrecision::Float)
    return;  // the coordinates are single precision already
  const Imath::Box3d box = bounds(mesh);
  if (box.isEmpty()) return;
  double farthest = 0;
  for (int axis = 0; axis < 3; ++axis)
    farthest = std::max({farthest, std::abs(box.min[axis]), std::abs(box.max[axis])});
  const Imath::V3d size = box.size();
  const double longest = std::max({size.x, size.y, size.z});
  if (farthest < static_cast<double>(std::numeric_limits<float>::max()) &&
      spacingAt(farthest, CoordinatePrecision::Float) <= kStlPrecision * longest)
    return;
  throw InvalidInput(
      fmt::format("STL stores positions in single precision, too coarse for an object of size "
                  "{:.3g} at a distance of {:.3g} from the origin; write PLY, OBJ or OFF, or move "
                  "the object to the origin first",
                  longest, farthest));
}

}  // namespace

void readStl(std::string_view input, MeshBuilder& builder) {
  if (isBinary(input, input.size()))
    readBinary(input, builder);
  else
    TextReader(input, builder).read();
}

MeshFileInfo stlInfo(std::string_view head, std::size_t fileSize, const std::string& name) {
  if (!isBinary(head, fileSize)) return {"stl, ascii", 0, 0};
  if (fileSize > 0) (void)facetCapacity(head, fileSize, name);
  return {"stl, binary", 0, head.size() >= kStlHeaderSize ? facetCount(head) : 0};
}

void writeStl(ByteWriter& out, const TriMesh& mesh, const Progress& progress) {
  requireSinglePrecision(mesh);
  if (mesh.triangles.size() > std::numeric_limits<std::uint32_t>::max())
    throw UsageError("STL cannot count more than 4294967295 triangles; write PLY");
  char header[80] = "binary STL, triangles counter-clockwise seen from outside";
  out.write(header, sizeof header);
  out.writeValue(static_cast<std::uint32_t>(mesh.triangles.size()));
  WriteProgress steps(progress, mesh.triangles.size());
  for (const auto& triangle : mesh.triangles) {
    const Imath::V3d corners[3] = {mesh.positions[triangle[0]], mesh.positions[triangle[1]],
                                   mesh.positions[triangle[2]]};
    const Imath::V3d normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalized();
    out.writeValue(Imath::V3f(normal));
    for (const Imath::V3d& corner : corners) out.writeValue(Imath::V3f(corner));
    out.writeValue(std::uint16_t{0});
    steps.step();
  }
}

}  // namespace levelset
