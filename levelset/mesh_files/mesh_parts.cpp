#include "levelset/mesh_files/mesh_parts.h"

#include <fmt/core.h>
#include <locale.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>

#include "levelset/error.h"

namespace levelset {
namespace {

constexpr std::uint64_t kMaxIndex = std::numeric_limits<std::uint32_t>::max();
constexpr std::uint64_t kSplit = std::uint64_t{1} << 63;  // marks a corner at a duplicate vertex
constexpr double kMaxCoordinate = std::numeric_limits<float>::max();
constexpr std::size_t kTickMask = 0xFFFF;

bool fitsFloat(double x) {
  return static_cast<double>(static_cast<float>(x)) == x;
}

template <typename Vector>
void requireNumbers(const std::string& name, const Vector& numbers, const char* what,
                    FilePosition place) {
  for (unsigned axis = 0; axis < Vector::dimensions(); ++axis)
    if (const auto number = numbers[static_cast<int>(axis)]; !std::isfinite(number))
      failAt(name, place,
             fmt::format("a {} holds {}, which is not a finite number; repair the mesh, or read it "
                         "without attributes (--no-attributes)",
                         what, number));
}

/// Returns the value of a number that std::from_chars reports as out of range: strtod gives ±
/// infinity for a number that is too large, and about 0 for one that is too small.
double extremeNumber(const char* first, const char* last) {
  static const locale_t plain = ::newlocale(LC_ALL_MASK, "C", nullptr);
  return ::strtod_l(std::string(first, last).c_str(), nullptr, plain);
}

}  // namespace

void failAt(const std::string& name, FilePosition place, const std::string& what) {
  throw InvalidInput(fmt::format("{}, {} {}: {}", name, place.unit, place.number, what));
}

void failFile(const std::string& name, const std::string& what) {
  throw InvalidInput(fmt::format("{} {}", name, what));
}

void requireText(std::string_view input, const std::string& name, const char* format) {
  if (input.substr(0, 4096).find('\0') != std::string_view::npos)
    failFile(name, fmt::format("holds binary data, not {} text; give its actual format", format));
}

void requireNoTrailingData(std::string_view input, std::size_t end, const std::string& name,
                           const std::string& what) {
  const std::size_t more = input.find_first_not_of(" \t\r\n\f\v", end);
  if (more == std::string_view::npos) return;
  failFile(name, fmt::format("has data after {}, at byte {} of {}; its header is damaged or "
                             "data was appended: export it again",
                             what, more, input.size()));
}

// === MeshBuilder

MeshBuilder::MeshBuilder(std::string name, const ReadMeshOptions& options, std::string_view input)
    : name_(std::move(name)), options_(options), input_(input) {}

void MeshBuilder::reserve(std::size_t vertices, std::size_t triangles, std::size_t attributeBytes) {
  if (vertices > kMaxIndex)
    failFile(name_, fmt::format("holds {} vertices, more than the maximum of 4294967295; "
                                "split the mesh",
                                vertices));
  const double bytes = static_cast<double>(input_.size() + attributeBytes) +
                       static_cast<double>(vertices) * sizeof(Imath::V3d) +
                       static_cast<double>(triangles) * sizeof(mesh_.triangles[0]);
  requireMemory(bytes, options_.maxMemory);
  mesh_.positions.reserve(vertices);
  mesh_.triangles.reserve(triangles);
}

void MeshBuilder::declarePrecision(CoordinatePrecision precision) {
  mesh_.precision = precision;
  precisionDeclared_ = true;
}

void MeshBuilder::tick(const char* at) {
  if ((++added_ & kTickMask) != 0) return;
  report(options_.progress,
         static_cast<double>(at - input_.data()) / static_cast<double>(input_.size()));
  requireMore(0);
  if (mesh_.positions.size() > kMaxIndex)
    failFile(name_, "holds more than 4294967295 vertices; split the mesh");
}

void MeshBuilder::requireMore(double bytes) const {
  const MeshAttributes& held = mesh_.attributes;
  const std::size_t now =
      input_.size() + readerBytes_ + mesh_.positions.capacity() * sizeof(Imath::V3d) +
      mesh_.triangles.capacity() * sizeof(mesh_.triangles[0]) +
      polygons_.capacity() * sizeof(Polygon) + splitVertices_.capacity() * sizeof(std::uint32_t) +
      held.normals.capacity() * sizeof(held.normals[0]) +
      held.uvs.capacity() * sizeof(held.uvs[0]) + held.colors.capacity() * sizeof(held.colors[0]);
  requireMemory(static_cast<double>(now) + bytes, options_.maxMemory);
}

void MeshBuilder::noteUnsupported(std::string what) {
  if (options_.unsupported) options_.unsupported->push_back(std::move(what));
}

void MeshBuilder::addVertex(double x, double y, double z, FilePosition place, const char* at) {
  for (const double c : {x, y, z}) {
    if (std::abs(c) <= kMaxCoordinate) continue;
    const bool finite = std::isfinite(c);
    failAt(name_, place,
           fmt::format("the coordinate {} is {}; {}", c,
                       finite ? "beyond the range of float, 3.4e38" : "not a finite number",
                       finite ? "scale the model down" : "repair the mesh or export it again"));
  }
  if (!precisionDeclared_) allFloat_ = allFloat_ && fitsFloat(x) && fitsFloat(y) && fitsFloat(z);
  mesh_.positions.emplace_back(x, y, z);
  tick(at);
}

void MeshBuilder::addNormal(const Imath::V3d& normal, FilePosition place) {
  requireNumbers(name_, normal, "normal", place);
  mesh_.attributes.normals.push_back(normal);
}

void MeshBuilder::addUv(const Imath::V2d& uv, FilePosition place) {
  requireNumbers(name_, uv, "texture coordinate", place);
  mesh_.attributes.uvs.push_back(uv);
}

void MeshBuilder::addColor(const Imath::V4f& color, FilePosition place) {
  requireNumbers(name_, color, "colour", place);
  mesh_.attributes.colors.push_back(color);
}

void MeshBuilder::noteIndex(std::uint64_t index, FilePosition place) {
  if (index < highestIndex_ || (index == highestIndex_ && highestNumber_ != 0)) return;
  highestIndex_ = index;
  highestUnit_ = place.unit;
  highestNumber_ = place.number;
}

std::uint64_t MeshBuilder::splitVertex(std::uint64_t vertex, FilePosition place) {
  noteIndex(vertex, place);
  splitVertices_.push_back(static_cast<std::uint32_t>(vertex));
  // The final number of the duplicate is unknown until all vertices are read. Until then, kMaxIndex
  // − n stands for the n-th duplicate in the corners of triangles.
  return kSplit | (kMaxIndex - (splitVertices_.size() - 1));
}

void MeshBuilder::placeSplitVertices() {
  const std::size_t before = mesh_.positions.size(), splits = splitVertices_.size();
  if (splits == 0) return;
  if (before + splits > kMaxIndex) {
    failFile(name_,
             "has more than 4294967295 vertices after duplicating those with several normals or "
             "texture coordinates; split the mesh");
  }
  const std::uint64_t first = kMaxIndex - (splits - 1);
  for (auto& triangle : mesh_.triangles)
    for (std::uint32_t& corner : triangle)
      if (corner >= first) corner = static_cast<std::uint32_t>(before + (kMaxIndex - corner));
  requireMore(static_cast<double>(before + splits) * sizeof(Imath::V3d));
  mesh_.positions.reserve(before + splits);
  for (const std::uint32_t vertex : splitVertices_)
    mesh_.positions.push_back(mesh_.positions[vertex]);
}

void MeshBuilder::addFace(std::span<const std::uint64_t> corners, FilePosition place,
                          const char* at) {
  for (const std::uint64_t corner : corners)
    if ((corner & kSplit) == 0) noteIndex(corner, place);
  if (corners.size() > 3)
    polygons_.push_back({mesh_.triangles.size(), corners.size(), place.number});
  // Stores the corners as a fan of triangles. splitPolygons() replaces it when all vertices are
  // known.
  for (std::size_t i = 2; i < corners.size(); ++i) {
    mesh_.triangles.push_back({static_cast<std::uint32_t>(corners[0]),
                               static_cast<std::uint32_t>(corners[i - 1]),
                               static_cast<std::uint32_t>(corners[i])});
  }
  tick(at);
}

void MeshBuilder::splitPolygons() {
  std::vector<std::uint32_t> corners;
  for (const Polygon& polygon : polygons_) {
    auto* triangles = mesh_.triangles.data() + polygon.firstTriangle;
    corners.assign({triangles[0][0], triangles[0][1]});
    for (std::size_t i = 0; i + 2 < polygon.corners; ++i) corners.push_back(triangles[i][2]);
    if (!splitPolygon(corners, mesh_.positions, triangles)) {
      failAt(name_, {highestUnit_.c_str(), polygon.place},
             fmt::format("a face of {} corners is too complex to split; triangulate the mesh first",
                         polygon.corners));
    }
  }
}

TriMesh MeshBuilder::finish() {
  const std::size_t count = mesh_.positions.size();
  if (count > kMaxIndex) failFile(name_, "holds more than 4294967295 vertices; split the mesh");
  if (mesh_.triangles.empty())
    failFile(
        name_,
        fmt::format("holds {} vertices and no triangles; export the mesh with its faces", count));
  if (highestIndex_ >= count) {
    failAt(name_, {highestUnit_.c_str(), highestNumber_},
           fmt::format("a face refers to vertex {} (counted from 0), but the mesh has {} vertices; "
                       "repair the mesh or export it again",
                       highestIndex_, count));
  }
  placeSplitVertices();
  splitPolygons();
  if (!precisionDeclared_)
    mesh_.precision = allFloat_ ? CoordinatePrecision::Float : CoordinatePrecision::Double;
  return std::move(mesh_);
}

// === TextCursor

TextCursor::TextCursor(std::string_view text, const std::string& name, std::size_t firstLine)
    : p_(text.data()), end_(text.data() + text.size()), line_(firstLine), name_(name) {
  if (text.starts_with("\xEF\xBB\xBF")) p_ += 3;  // byte order mark
}

bool TextCursor::skipContinuation() {
  const char* next = p_ + 1;
  if (next != end_ && *next == '\r') ++next;
  if (next == end_ || *next != '\n') return false;
  p_ = next + 1;
  ++line_;
  return true;
}

bool TextCursor::skipToToken(char comment) {
  while (!skipBlanks(comment)) {
    if (atEnd()) return false;
    skipLine();
  }
  return true;
}

void TextCursor::skipLine() {
  const auto* end = static_cast<const char*>(std::memchr(p_, '\n', remaining()));
  if (!end) {
    p_ = end_;
    return;
  }
  p_ = end + 1;
  ++line_;
}

std::string_view TextCursor::token() {
  const char* begin = p_;
  if (p_ != end_ && *p_ == '\\')
    ++p_;  // a backslash that does not continue the line is part of the token
  while (!atBlank()) ++p_;
  return {begin, static_cast<std::size_t>(p_ - begin)};
}

double TextCursor::number(const char* what) {
  const char* begin = p_;
  if (begin != end_ && *begin == '+') ++begin;
  double value = 0;
  const auto [end, error] = std::from_chars(begin, end_, value);
  if (error == std::errc::invalid_argument) failNumber(what);
  if (error == std::errc::result_out_of_range) value = extremeNumber(begin, end);
  const char* start = p_;
  p_ = end;
  if (!atBlank()) {
    p_ = start;
    failNumber(what);
  }
  return value;
}

std::int64_t TextCursor::integer(const char* what) {
  const char* begin = p_;
  if (begin != end_ && *begin == '+') ++begin;
  std::int64_t value = 0;
  const auto [end, error] = std::from_chars(begin, end_, value);
  if (error != std::errc{}) failNumber(what);
  p_ = end;
  return value;
}

void TextCursor::failNumber(const char* what) const {
  if (atEnd()) {
    fail(fmt::format("the file ends where {} is expected; download or export it again", what));
  }
  const char* end = p_;
  while (end != end_ && end - p_ < 24 && static_cast<unsigned char>(*end) > ' ') ++end;
  std::string found(p_, end);
  std::replace_if(
      found.begin(), found.end(), [](char c) { return static_cast<unsigned char>(c) < ' '; }, '?');
  if (found.empty()) fail(fmt::format("{} is missing; repair the file or export it again", what));
  fail(fmt::format("found '{}' where {} is expected; repair the file or export it again", found,
                   what));
}

}  // namespace levelset
