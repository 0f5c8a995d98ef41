#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <initializer_list>
#include <limits>
#include <unordered_map>
#include <utility>

#include "levelset/error.h"
#include "levelset/geometry/position_table.h"
#include "levelset/mesh_files/mesh_parts.h"

// Wavefront OBJ: Wavefront Technologies, "The Advanced Visualizer Manual", appendix B1, 1992.

namespace levelset {
namespace {

/// Assigns a separate vertex to each pair of texture coordinate and normal at a vertex. The vertex
/// itself takes the first pair; each further pair gets a duplicate of the vertex. Corners without
/// texture coordinate and normal use the vertex itself.
class Seams {
 public:
  static constexpr std::uint32_t kNone = 0xffffffffu;
  using Pair = std::array<std::uint32_t, 2>;  // indices of texture coordinate and normal

  /// @param maxVertices  maximum number of vertices that a file of this size can hold; faces with
  /// larger indices are invalid
  Seams(MeshBuilder& builder, std::size_t maxVertices)
      : builder_(builder), maxVertices_(maxVertices) {}

  std::uint64_t corner(std::uint64_t vertex, const Pair& pair, FilePosition place) {
    if (pair == kNeither || vertex >= maxVertices_) return vertex;
    if (vertex >= first_.size()) first_.resize(vertex + 1, kNeither);
    if (first_[vertex] == kNeither) first_[vertex] = pair;
    if (first_[vertex] == pair) return vertex;
    const auto [found, isNew] = others_.try_emplace(Key{vertex, pair}, 0);
    if (isNew) {
      found->second = builder_.splitVertex(vertex, place);
      splits_.push_back(found->first);
    }
    return found->second;
  }

  /// Returns the pairs of all vertices, followed by the pairs of the duplicates.
  [[nodiscard]] std::vector<Pair> pairs(std::size_t vertices) const {
    std::vector<Pair> result;
    result.reserve(vertices + splits_.size());
    result = first_;
    result.resize(vertices, kNeither);
    for (const Key& split : splits_) result.push_back(split.pair);
    return result;
  }
  /// Number of duplicate vertices; originalOf(n) is the original of the n-th one.
  [[nodiscard]] std::size_t splitCount() const { return splits_.size(); }
  [[nodiscard]] std::uint64_t originalOf(std::size_t n) const { return splits_[n].vertex; }

  [[nodiscard]] std::size_t bytes() const {
    constexpr std::size_t kNode = 64;
    return first_.capacity() * sizeof(Pair) + splits_.capacity() * sizeof(Key) +
           others_.size() * kNode;
  }

 private:
  static constexpr Pair kNeither = {kNone, kNone};
  struct Key {
    std::uint64_t vertex;
    Pair pair;
    bool operator==(const Key&) const = default;
  };
  struct Hash {
    std::size_t operator()(const Key& key) const {
      std::uint64_t hash = key.vertex * 0x9e3779b97f4a7c15ull;
      hash = ((hash ^ (hash >> 29)) + key.pair[0]) * 0xbf58476d1ce4e5b9ull;
      hash = ((hash ^ (hash >> 32)) + key.pair[1]) * 0x94d049bb133111ebull;
      return hash ^ (hash >> 31);
    }
  };

  MeshBuilder& builder_;
  std::size_t maxVertices_;
  std::vector<Pair> first_;
  std::vector<Key> splits_;
  std::unordered_map<Key, std::uint64_t, Hash> others_;
};

class ObjReader {
 public:
  ObjReader(std::string_view input, MeshBuilder& builder)
      : cursor_(input, builder.name()), builder_(builder), seams_(builder, input.size() / 7 + 1) {}

  void read() {
    while (!cursor_.atEnd()) {
      if (cursor_.skipBlanks('#', true)) readStatement();
      cursor_.skipLine();
    }
    if (builder_.wantsAttributes()) storeAttributes();
  }

 private:
  struct IndexName {
    const char *noun, *index;
  };
  static constexpr IndexName kVertex = {"vertex", "the index of a vertex"},
                             kUv = {"texture coordinate", "the index of a texture coordinate"},
                             kNormal = {"normal", "the index of a normal"};

  /// References of faces to the texture coordinates or to the normals: greatest index + 1 and the
  /// face that uses it.
  struct References {
    std::uint64_t count = 0;
    FilePosition place{"line", 0};
    std::vector<bool> seen;  ///< true for entries that a later face refers to
    void note(std::uint64_t index, std::size_t soFar, FilePosition at) {
      if (index < soFar) {
        if (seen.size() < soFar) seen.resize(soFar);
        seen[index] = true;
      } else {
        isAhead = true;
      }
      if (index < count) return;
      count = index + 1;
      place = at;
    }
    bool isAhead = false;  ///< true when a face preceded an entry that it refers to
    [[nodiscard]] std::size_t unreferenced(std::size_t all) const {
      if (isAhead) return 0;  // number unknown: `seen` is incomplete
      return all - static_cast<std::size_t>(std::count(seen.begin(), seen.end(), true));
    }
  };

  /// All texture coordinates or normals of a file, and for each the index of the first equal value.
  /// Seams lie where values differ, not where a file repeats a value.
  template <typename Vector>
  struct Values {
    std::vector<Vector> all;
    std::vector<std::uint32_t> first;
    convert::ValueTable<Vector> table{all, 0};
    void add(const Vector& value) {
      all.push_back(value);
      const auto index =
          static_cast<std::uint32_t>(std::min<std::size_t>(all.size(), kMaxCount) - 1);
      first.push_back(all.size() <= kMaxCount ? table.findOrInsert(value, index) : index);
    }
    /// Index of the first equal value. A value that has not been read yet represents itself.
    [[nodiscard]] std::uint32_t firstEqual(std::uint64_t index) const {
      if (index < first.size()) return first[index];
      return static_cast<std::uint32_t>(std::min<std::uint64_t>(index, kMaxCount));
    }
    [[nodiscard]] std::size_t bytes() const {
      return all.capacity() * sizeof(Vector) + first.capacity() * sizeof(first[0]) + table.bytes();
    }
    static constexpr std::size_t kMaxCount = Seams::kNone - 1;
  };

  void readStatement() {
    const std::string_view keyword = cursor_.token();
    if (keyword == "v") return readVertex();
    if (keyword == "f" || keyword == "fo") return readFace();
    if (builder_.wantsAttributes()) {
      if (keyword == "vt") return readUv();
      if (keyword == "vn") return readNormal();
    }
    while (cursor_.skipBlanks('#', true))
      skipToken();  // skips the statement with its continuation lines
  }

  void skipToken() { static_cast<void>(cursor_.token()); }

  double readNumber(const char* what) {
    cursor_.skipBlanks('#', true);
    const FilePosition place = cursor_.place();
    const double number = cursor_.number(what);
    if (!std::isfinite(number)) failAt(builder_.name(), place, notFinite(what, number));
    return number;
  }

  static std::string notFinite(const char* what, double number) {
    return fmt::format(
        "{} is {}, which is not a finite number; repair the mesh, or read it "
        "without attributes (--no-attributes)",
        what, number);
  }

  void readUv() {
    const double u = readNumber("a texture coordinate");
    const double v = cursor_.skipBlanks('#', true) ? readNumber("a texture coordinate") : 0;
    uvs_.add({u, v});
    while (cursor_.skipBlanks('#', true))
      skipToken();  // a third number is the depth of a solid
                    // texture
    noteBytes();
  }

  void readNormal() {
    Imath::V3d normal;
    for (int axis = 0; axis < 3; ++axis) normal[axis] = readNumber("a coordinate of a normal");
    normals_.add(normal);
    while (cursor_.skipBlanks('#', true)) skipToken();
    noteBytes();
  }

  void noteBytes() {
    builder_.noteBytes(uvs_.bytes() + normals_.bytes() + colors_.capacity() * sizeof(colors_[0]) +
                       seams_.bytes());
  }

  void readVertex() {
    const FilePosition place = cursor_.place();
    double position[3];
    for (double& coordinate : position) {
      cursor_.skipBlanks('#', true);
      coordinate = cursor_.number("a coordinate");
    }
    builder_.addVertex(position[0], position[1], position[2], place, cursor_.at());
    if (builder_.wantsAttributes()) readColor();
    while (cursor_.skipBlanks('#', true)) skipToken();
  }

  /// Reads the numbers after the coordinates of a vertex. Three or four are a colour; one or two
  /// (a weight) are ignored.
  void readColor() {
    std::array<double, 4> numbers = {1, 1, 1, 1};
    std::size_t count = 0;
    const FilePosition place = cursor_.place();
    for (; count < 4 && cursor_.skipBlanks('#', true); ++count)
      numbers[count] = cursor_.number("a weight or colour after the coordinates");
    if (count < 3) return;
    for (const double number : numbers)
      if (!(std::abs(number) <= std::numeric_limits<float>::max()))
        failAt(builder_.name(), place, notFinite("a colour", number));
    colors_.resize(builder_.vertexCount(), Imath::V4f(1));  // white for vertices without a colour
    for (int i = 0; i < 4; ++i)
      colors_.back()[i] = static_cast<float>(numbers[static_cast<std::size_t>(i)]);
    hasAlpha_ = hasAlpha_ || count == 4;
    noteBytes();
  }

  void readFace() {
    const FilePosition place = cursor_.place();
    corners_.clear();
    while (cursor_.skipBlanks('#', true)) {
      const std::uint64_t vertex = readIndex(kVertex, builder_.vertexCount());
      Seams::Pair pair = {Seams::kNone, Seams::kNone};
      for (std::size_t i = 0; cursor_.take('/'); ++i)
        if (!cursor_.atBlank() && *cursor_.at() != '/') readPart(i, place, pair);
      if (!cursor_.atBlank())
        cursor_.fail(
            "a corner of a face is not of the form v, v/t, v//n or v/t/n; export "
            "the mesh again");
      corners_.push_back(builder_.wantsAttributes() ? seams_.corner(vertex, pair, place) : vertex);
    }
    if (builder_.wantsAttributes()) noteBytes();
    builder_.addFace(corners_, place, cursor_.at());
  }

  /// Reads the index of a texture coordinate (part 0) or of a normal (part 1) of a face corner.
  /// Skips further parts, and both when attributes are not requested.
  void readPart(std::size_t part, FilePosition place, Seams::Pair& pair) {
    if (!builder_.wantsAttributes() || part > 1) {
      static_cast<void>(cursor_.integer("the index of a texture coordinate or normal"));
      return;
    }
    const std::size_t soFar = part == 0 ? uvs_.all.size() : normals_.all.size();
    const std::uint64_t index = readIndex(part == 0 ? kUv : kNormal, soFar);
    (part == 0 ? uvReferences_ : normalReferences_).note(index, soFar, place);
    pair[part] = part == 0 ? uvs_.firstEqual(index) : normals_.firstEqual(index);
  }

  /// Reads an index and returns it counted from 0. Negative indices count back from the latest
  /// entry.
  std::uint64_t readIndex(const IndexName& what, std::size_t soFar) {
    const std::int64_t index = cursor_.integer(what.index);
    const auto count = static_cast<std::int64_t>(soFar);
    if (index > 0) return static_cast<std::uint64_t>(index - 1);
    if (index == 0)
      cursor_.fail(fmt::format(
          "a face refers to {} 0, but OBJ counts from 1; export the mesh again", what.noun));
    if (index < -count)
      cursor_.fail(
          fmt::format("a face refers to {} {}, but only {} precede it; repair the mesh or "
                      "export it again",
                      what.noun, index, count));
    return static_cast<std::uint64_t>(count + index);
  }

  void checkReferences(const References& named, std::size_t count, const char* what) const {
    if (named.count <= count) return;
    failAt(builder_.name(), named.place,
           fmt::format("a face refers to {} {}, but the file has only {}; repair the mesh, or read "
                       "it without attributes (--no-attributes)",
                       what, named.count, count));
  }

  void storeAttributes() {
    checkReferences(uvReferences_, uvs_.all.size(), "texture coordinate");
    checkReferences(normalReferences_, normals_.all.size(), "normal");
    reportUnreferenced(uvReferences_, uvs_.all.size(), "texture coordinates");
    reportUnreferenced(normalReferences_, normals_.all.size(), "normals");
    MeshAttributes& attributes = builder_.attributes();
    const std::size_t count = builder_.vertexCount(), whole = count + builder_.splitCount();
    const bool hasUvs = uvReferences_.count > 0, hasNormals = normalReferences_.count > 0,
               hasColors = !colors_.empty();
    const std::size_t perVertex =
        (hasUvs ? sizeof(Imath::V2d) : 0) + (hasNormals ? sizeof(Imath::V3d) : 0) +
        (hasUvs || hasNormals ? sizeof(Seams::Pair) : 0) + (hasColors ? sizeof(Imath::V4f) : 0);
    noteBytes();
    builder_.requireMore(static_cast<double>(whole) * static_cast<double>(perVertex));
    if (hasUvs || hasNormals) {
      if (hasUvs) attributes.uvs.reserve(whole);
      if (hasNormals) attributes.normals.reserve(whole);
      for (const auto& [uv, normal] : seams_.pairs(count)) {
        if (hasUvs) attributes.uvs.push_back(uv == Seams::kNone ? Imath::V2d(0) : uvs_.all[uv]);
        if (hasNormals)
          attributes.normals.push_back(normal == Seams::kNone ? Imath::V3d(0)
                                                              : normals_.all[normal]);
      }
      bool allFloat = true;
      for (const Imath::V2d& uv : attributes.uvs)
        allFloat = allFloat && Imath::V2d(Imath::V2f(uv)) == uv;
      for (const Imath::V3d& normal : attributes.normals)
        allFloat = allFloat && Imath::V3d(Imath::V3f(normal)) == normal;
      attributes.precision = allFloat ? CoordinatePrecision::Float : CoordinatePrecision::Double;
    }
    if (hasColors) storeColors(attributes, count, whole);
    builder_.noteBytes(0);  // the reader's lists are freed before the mesh is completed
  }

  void reportUnreferenced(const References& named, std::size_t count, const char* what) {
    if (const std::size_t unreferenced = named.unreferenced(count))
      builder_.noteUnsupported(
          fmt::format("{} of {} {}, which no face refers to", unreferenced, count, what));
  }

  void storeColors(MeshAttributes& attributes, std::size_t count, std::size_t whole) {
    colors_.reserve(whole);
    colors_.resize(count, Imath::V4f(1));
    for (std::size_t n = 0; n < seams_.splitCount(); ++n)
      if (seams_.originalOf(n) < count) colors_.push_back(colors_[seams_.originalOf(n)]);
    const bool allBytes = std::all_of(colors_.begin(), colors_.end(), isOfBytes);
    attributes.colorPrecision = allBytes ? ColorPrecision::Byte : ColorPrecision::Float;
    attributes.hasAlpha = hasAlpha_;
    attributes.colors = std::move(colors_);
  }

  /// Returns true when every component equals n / 255 rounded to float, as written by a program
  /// that stores colours as bytes.
  static bool isOfBytes(const Imath::V4f& color) {
    for (int i = 0; i < 4; ++i)
      if (!(color[i] >= 0 && color[i] <= 1) || std::round(color[i] * 255) / 255 != color[i])
        return false;
    return true;
  }

  TextCursor cursor_;
  MeshBuilder& builder_;
  Seams seams_;
  std::vector<std::uint64_t> corners_;
  Values<Imath::V2d> uvs_;
  Values<Imath::V3d> normals_;
  std::vector<Imath::V4f> colors_;
  References uvReferences_, normalReferences_;
  bool hasAlpha_ = false;
};

void writeNumbers(ByteWriter& out, std::initializer_list<double> numbers) {
  for (const double number : numbers) {
    out.write(" ");
    out.writeNumber(number);
  }
  out.write("\n");
}

}  // namespace

void readObj(std::string_view input, MeshBuilder& builder) {
  requireText(input, builder.name(), "OBJ");
  ObjReader(input, builder).read();
}

void writeObj(ByteWriter& out, const TriMesh& mesh, const Progress& progress) {
  const MeshAttributes& held = mesh.attributes;
  const bool hasUvs = !held.uvs.empty(), hasNormals = !held.normals.empty();
  WriteProgress steps(progress, mesh.positions.size() + mesh.triangles.size());
  for (std::size_t v = 0; v < mesh.positions.size(); ++v) {
    out.write("v");
    for (int axis = 0; axis < 3; ++axis) {
      out.write(" ");
      out.writeNumber(mesh.positions[v][axis]);
    }
    for (int i = 0; i < (held.colors.empty() ? 0 : held.hasAlpha ? 4 : 3); ++i) {
      const float part = held.colors[v][i];
      out.write(" ");
      // A byte n is written as n / 255 with the few digits that identify it as a float, a float
      // with the digits that identify it as a double.
      if (held.colorPrecision == ColorPrecision::Byte)
        out.writeNumber(std::round(std::clamp(part, 0.0f, 1.0f) * 255) / 255);
      else
        out.writeNumber(static_cast<double>(part));
    }
    out.write("\n");
    steps.step();
  }
  for (const Imath::V2d& uv : held.uvs) {
    out.write("vt");
    writeNumbers(out, {uv.x, uv.y});
  }
  for (const Imath::V3d& normal : held.normals) {
    out.write("vn");
    writeNumbers(out, {normal.x, normal.y, normal.z});
  }
  for (const auto& triangle : mesh.triangles) {
    out.write("f");
    for (const std::uint32_t corner : triangle) {
      const std::uint64_t number = std::uint64_t{corner} + 1;
      out.write(" ");
      out.writeNumber(number);
      if (!hasUvs && !hasNormals) continue;
      out.write("/");
      if (hasUvs) out.writeNumber(number);
      if (!hasNormals) continue;
      out.write("/");
      out.writeNumber(number);
    }
    out.write("\n");
    steps.step();
  }
}

}  // namespace levelset
