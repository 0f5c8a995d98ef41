#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "levelset/error.h"
#include "levelset/point_files/cloud_builder.h"

namespace levelset::point_files {
namespace {

class ObjPointReader {
 public:
  ObjPointReader(std::string_view input, CloudBuilder& builder)
      : cursor_(input, builder.name()), builder_(builder) {}

  void read() {
    while (!cursor_.atEnd()) {
      if (cursor_.skipBlanks('#', true)) readStatement();
      cursor_.skipLine();
    }
    PointCloud& cloud = builder_.cloud();
    if (!cloud.normals.empty() && cloud.normals.size() != cloud.size()) {
      builder_.note(fmt::format("left out {} normals, which are not one for each of the {} points",
                                cloud.normals.size(), cloud.size()));
      cloud.normals = {};
    }
    if (!cloud.colors.empty()) finishColors(cloud);
  }

 private:
  void readStatement() {
    const std::string_view keyword = cursor_.token();
    if (keyword == "v") readPosition();
    if (keyword == "vn" && builder_.wantsAttributes())
      builder_.addNormal(readVector("a coordinate of a normal"), cursor_.place());
    while (cursor_.skipBlanks('#', true))  // skips the statement with its continuation lines
      static_cast<void>(cursor_.token());
  }

  Imath::V3d readVector(const char* what) {
    Imath::V3d vector;
    for (int axis = 0; axis < 3; ++axis) {
      cursor_.skipBlanks('#', true);
      vector[axis] = cursor_.number(what);
    }
    return vector;
  }

  void readPosition() {
    const FilePosition place = cursor_.place();
    builder_.addPosition(readVector("a coordinate"), place, cursor_.at());
    if (!builder_.wantsAttributes()) return;
    Imath::V4d color(kNotGiven);
    int count = 0;
    for (; count < 4 && cursor_.skipBlanks('#', true); ++count)
      color[count] = cursor_.number("a weight or colour after the coordinates");
    if (count < 3) return;  // one or two numbers are a weight of a curve, which is not kept
    for (int part = 0; part < count; ++part) {
      requireColorPart(builder_.name(), place, color[part]);
      exceedsOne_ = exceedsOne_ || color[part] > 1;
    }
    PointCloud& cloud = builder_.cloud();
    cloud.colors.resize(cloud.size() - 1, Imath::V4f(kNotGiven));
    builder_.addColor(Imath::V4f(color), place);
  }

  /// Scales the colours, once all are known. Points without a colour become white, and colours
  /// without alpha opaque.
  void finishColors(PointCloud& cloud) const {
    cloud.colors.resize(cloud.size(), Imath::V4f(kNotGiven));
    for (Imath::V4f& color : cloud.colors)
      for (int part = 0; part < 4; ++part)
        color[part] = color[part] == kNotGiven ? 1 : exceedsOne_ ? color[part] / 255 : color[part];
  }

  static constexpr float kNotGiven = -1;  ///< stands for a part of a colour that the file lacks

  TextCursor cursor_;
  CloudBuilder& builder_;
  bool exceedsOne_ = false;
};

template <typename Vector>
void writeTriple(ByteWriter& out, const char* keyword, const Vector& v) {
  out.write(keyword);
  for (int axis = 0; axis < 3; ++axis) {
    out.write(" ");
    out.writeNumber(v[axis]);
  }
}

}  // namespace

void readObjPoints(std::string_view input, CloudBuilder& builder) {
  requireText(input, builder.name(), "OBJ");
  ObjPointReader(input, builder).read();
}

bool objLacksFaces(std::string_view input) {
  bool hasPoints = false;
  std::size_t at = 0;
  while (at < input.size()) {
    const std::size_t begin = input.find_first_not_of(" \t\r\n", at);
    if (begin == std::string_view::npos) break;
    const std::string_view rest = input.substr(begin, 3);
    const auto isKeyword = [&](std::string_view word) {
      return rest.starts_with(word) &&
             (rest.size() == word.size() || static_cast<unsigned char>(rest[word.size()]) <= ' ');
    };
    if (isKeyword("f") || isKeyword("fo")) return false;
    hasPoints = hasPoints || isKeyword("v");
    at = input.find('\n', begin);
    if (at == std::string_view::npos) break;
  }
  return hasPoints;
}

void writeObjPoints(ByteWriter& out, const PointCloud& cloud, const Progress& progress) {
  const bool asBytes = hasByteColors(cloud), withAlpha = hasAlpha(cloud);
  WriteProgress steps(progress, cloud.size());
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    writeTriple(out, "v", cloud.positions[i]);
    for (int part = 0; part < (cloud.colors.empty() ? 0 : withAlpha ? 4 : 3); ++part) {
      out.write(" ");
      // A byte n is written as n / 255 with the digits that identify it as a float.
      if (asBytes)
        out.writeNumber(static_cast<float>(colorByte(cloud.colors[i][part])) / 255);
      else
        out.writeNumber(std::clamp(cloud.colors[i][part], 0.0f, 1.0f));
    }
    out.write("\n");
    steps.step();
  }
  for (const Imath::V3f& normal : cloud.normals) {
    writeTriple(out, "vn", normal);
    out.write("\n");
  }
}

}  // namespace levelset::point_files
