#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstring>
#include <limits>
#include <optional>
#include <vector>

#include "levelset/error.h"
#include "levelset/point_files/cloud_builder.h"

namespace levelset::point_files {
namespace {

enum class Column { X, Y, Z, Nx, Ny, Nz, Red, Green, Blue, Alpha, Radius, Weight, Skip };
constexpr std::size_t kColumns = static_cast<std::size_t>(Column::Skip);
constexpr std::size_t kMostColumns = 64;
constexpr std::size_t kMostLine = 4096;

bool isSeparator(char c) {
  return static_cast<unsigned char>(c) <= ' ' || c == ',' || c == ';';
}

/// Reads a text line by line, and a line number by number.
class Lines {
 public:
  Lines(std::string_view text, const std::string& name) : text_(text), name_(name) {
    if (text_.starts_with("\xEF\xBB\xBF")) at_ = 3;  // byte order mark
  }

  /// Moves to the next line that is neither empty nor a comment. Returns false at the end.
  bool next() {
    while (at_ < text_.size()) {
      const std::size_t end = lineEnd();
      line_ = text_.substr(at_, end - at_);
      const bool isPair = text_.substr(end).starts_with("\r\n");
      at_ = std::min(end + (isPair ? 2 : 1), text_.size());
      ++number_;
      const std::size_t first = line_.find_first_not_of(" \t\r\v\f");
      if (first == std::string_view::npos) continue;
      line_.remove_prefix(first);
      if (line_.size() > kMostLine) fail("the line is longer than 4096 bytes");
      if (line_[0] == '#' || line_.starts_with("//")) {
        comment_ = line_.substr(line_[0] == '#' ? 1 : 2);
        continue;
      }
      return true;
    }
    return false;
  }
  [[nodiscard]] std::string_view line() const { return line_; }
  /// Last comment before the present line, without its sign.
  [[nodiscard]] std::string_view comment() const { return comment_; }
  [[nodiscard]] const std::string& name() const { return name_; }
  [[nodiscard]] FilePosition place() const { return {"line", number_}; }
  [[nodiscard]] const char* at() const { return text_.data() + at_; }
  [[noreturn]] void fail(const std::string& what) const {
    failAt(name_, place(), what + "; repair the line or export the points again");
  }

  /// Splits the present line into numbers. Returns empty when a word is no number. Refuses numbers
  /// with an empty field, and those that different signs separate.
  [[nodiscard]] std::optional<std::size_t> numbers(std::array<double, kMostColumns>& out) const {
    const char* p = line_.data();
    const char* end = p + line_.size();
    std::size_t count = 0;
    bool needsNumber = false;  // a comma has been read, and no number behind it
    bool hasEmpty = false, hasComma = false, hasSemicolon = false, hasBlank = false;
    while (true) {
      while (p != end && static_cast<unsigned char>(*p) <= ' ') ++p;
      if (p == end) break;
      if (*p == ',' || *p == ';') {
        hasEmpty = hasEmpty || needsNumber || count == 0;
        (*p == ',' ? hasComma : hasSemicolon) = true;
        needsNumber = true;
        ++p;
        continue;
      }
      hasBlank = hasBlank || (count > 0 && !needsNumber);
      if (count == kMostColumns) return std::nullopt;
      if (*p == '+') ++p;
      const auto [next, error] = std::from_chars(p, end, out[count]);
      if (error == std::errc::invalid_argument || (next != end && !isSeparator(*next)))
        return std::nullopt;
      if (error == std::errc::result_out_of_range) out[count] = extreme(p, next);
      ++count;
      p = next;
      needsNumber = false;
    }
    if (hasComma && (hasSemicolon || hasBlank))
      failAt(name_, place(),
             fmt::format("the line has commas, and {} between numbers; write decimal commas as "
                         "points, or use one separator",
                         hasSemicolon ? "semicolons" : "blanks"));
    if (hasEmpty || needsNumber)
      fail("the line has an empty field, before, behind or between separators");
    return count;
  }

 private:
  /// Position of the next line end: a line feed, a carriage return, or the end of the text.
  std::size_t lineEnd() {
    const auto find = [&](char sign, std::size_t from, std::size_t to) {
      const void* found = std::memchr(text_.data() + from, sign, to - from);
      return found ? static_cast<std::size_t>(static_cast<const char*>(found) - text_.data()) : to;
    };
    // The line feed is kept for later lines: a file may have carriage returns only.
    if (!isFeedKnown_ || feed_ < at_) feed_ = find('\n', at_, text_.size());
    isFeedKnown_ = true;
    return find('\r', at_, feed_);
  }

  /// Value of a number that a double cannot hold: infinite if its exponent is positive, else 0.
  static double extreme(const char* p, const char* end) {
    const char* exponent = std::find_if(p, end, [](char c) { return c == 'e' || c == 'E'; });
    const bool isSmall =
        exponent != end ? exponent + 1 != end && exponent[1] == '-' : *p == '0' || *p == '.';
    const double size = isSmall ? 0 : std::numeric_limits<double>::infinity();
    return *p == '-' ? -size : size;
  }

  std::string_view text_, line_, comment_;
  const std::string& name_;
  std::size_t at_ = 0, number_ = 0;
  std::size_t feed_ = 0;  ///< position of a line feed; the first one behind at_, unless feed_ < at_
  bool isFeedKnown_ = false;
};

std::vector<std::string> wordsOf(std::string_view text) {
  std::vector<std::string> words;
  std::string word;
  for (const char c : text) {
    if (isSeparator(c)) {
      if (!word.empty()) words.push_back(word);
      word.clear();
    } else if (c != '"' && c != '\'') {
      word += c >= 'A' && c <= 'Z' ? static_cast<char>(c | 0x20) : c;
    }
    if (words.size() == kMostColumns) break;
  }
  if (!word.empty() && words.size() < kMostColumns) words.push_back(word);
  return words;
}

Column columnOf(const std::string& word) {
  static constexpr std::pair<const char*, Column> kNames[] = {
      {"x", Column::X},           {"y", Column::Y},
      {"z", Column::Z},           {"nx", Column::Nx},
      {"ny", Column::Ny},         {"nz", Column::Nz},
      {"normal_x", Column::Nx},   {"normal_y", Column::Ny},
      {"normal_z", Column::Nz},   {"r", Column::Red},
      {"g", Column::Green},       {"b", Column::Blue},
      {"red", Column::Red},       {"green", Column::Green},
      {"blue", Column::Blue},     {"a", Column::Alpha},
      {"alpha", Column::Alpha},   {"radius", Column::Radius},
      {"weight", Column::Weight}, {"confidence", Column::Weight}};
  for (const auto& [name, column] : kNames)
    if (word == name) return column;
  return Column::Skip;
}

/// Columns of a file, in their order.
struct Layout {
  std::vector<Column> columns;
  std::vector<std::string> skipped = {};  ///< names of columns that are not kept
  /// True: the columns 4 to 6 are a normal or a colour, by their values.
  bool isUndecided = false;

  [[nodiscard]] bool has(Column column) const {
    return std::find(columns.begin(), columns.end(), column) != columns.end();
  }
  [[nodiscard]] bool hasAll(Column a, Column b, Column c) const {
    return has(a) && has(b) && has(c);
  }
};

std::optional<Layout> layoutOfNames(std::string_view line) {
  Layout layout;
  for (const std::string& word : wordsOf(line)) {
    Column column = columnOf(word);
    if (column != Column::Skip && layout.has(column)) column = Column::Skip;
    if (column == Column::Skip) layout.skipped.push_back(word);
    layout.columns.push_back(column);
  }
  if (!layout.hasAll(Column::X, Column::Y, Column::Z)) return std::nullopt;
  const auto drop = [&](Column a, Column b, Column c) {
    if (layout.hasAll(a, b, c)) return;
    for (Column& column : layout.columns)
      if (column == a || column == b || column == c) column = Column::Skip;
  };
  drop(Column::Nx, Column::Ny, Column::Nz);
  drop(Column::Red, Column::Green, Column::Blue);
  if (!layout.has(Column::Red))
    std::replace(layout.columns.begin(), layout.columns.end(), Column::Alpha, Column::Skip);
  return layout;
}

std::optional<Layout> layoutOfCount(std::size_t count, bool isPts) {
  using enum Column;
  if (count == 3) return Layout{{X, Y, Z}};
  if (count == 4) return Layout{{X, Y, Z, Skip}, {"intensity"}};
  if (count == 6 && isPts) return Layout{{X, Y, Z, Red, Green, Blue}};
  if (count == 6) return Layout{{X, Y, Z, Nx, Ny, Nz}, {}, true};
  if (count == 7) return Layout{{X, Y, Z, Skip, Red, Green, Blue}, {"intensity"}};
  if (count == 9 && !isPts) return Layout{{X, Y, Z, Nx, Ny, Nz, Red, Green, Blue}};
  return std::nullopt;
}

/// Reads the lines of points of one layout.
class PointLines {
 public:
  PointLines(Lines& lines, CloudBuilder& builder, Layout layout)
      : lines_(lines), builder_(builder), layout_(std::move(layout)) {
    if (!builder.wantsAttributes()) {
      for (Column& column : layout_.columns)
        if (column > Column::Z) column = Column::Skip;
      layout_.skipped.clear();
    }
    for (const std::string& name : layout_.skipped)
      builder_.note(fmt::format("left out the column '{}', which a point cloud does not keep",
                                printable(name)));
    hasNormals_ = layout_.has(Column::Nx);
    hasColors_ = layout_.has(Column::Red);
    hasRadii_ = layout_.has(Column::Radius);
    hasWeights_ = layout_.has(Column::Weight);
    values_[static_cast<std::size_t>(Column::Alpha)] = 255;
  }

  /// Reads the present line.
  void readLine() {
    std::array<double, kMostColumns> numbers;
    const std::optional<std::size_t> count = lines_.numbers(numbers);
    if (!count) lines_.fail("the line holds something other than numbers");
    if (*count != layout_.columns.size())
      lines_.fail(fmt::format("the line has {} numbers, and the first line of points has {}",
                              *count, layout_.columns.size()));
    for (std::size_t i = 0; i < *count; ++i)
      if (layout_.columns[i] != Column::Skip)
        values_[static_cast<std::size_t>(layout_.columns[i])] = numbers[i];
    const FilePosition place = lines_.place();
    builder_.addPosition({of(Column::X), of(Column::Y), of(Column::Z)}, place, lines_.at());
    if (hasNormals_) {
      const Imath::V3d normal(of(Column::Nx), of(Column::Ny), of(Column::Nz));
      builder_.addNormal(normal, place);
      for (int axis = 0; axis < 3 && layout_.isUndecided; ++axis) {
        const double c = normal[axis];
        mayBeColors_ = mayBeColors_ && c >= 0 && c <= 255 && std::floor(c) == c;
        exceedsOne_ = exceedsOne_ || c > 1;
      }
    }
    if (hasColors_) addColor(place);
    if (hasRadii_) builder_.addRadius(of(Column::Radius), place);
    if (hasWeights_) builder_.addWeight(of(Column::Weight), place);
  }

  /// Scales the colours, once all are known.
  void finish() {
    PointCloud& cloud = builder_.cloud();
    if (layout_.isUndecided && hasNormals_ && mayBeColors_ && exceedsOne_) {
      cloud.colors.reserve(cloud.size());
      for (const Imath::V3f& n : cloud.normals)
        cloud.colors.emplace_back(n.x / 255, n.y / 255, n.z / 255, 1.0f);
      cloud.normals = {};
    } else if (hasColors_ && exceedsOne_) {
      for (std::size_t i = 0; i < cloud.size(); ++i)
        for (int part = 0; part < 4; ++part) cloud.colors[i][part] /= 255;
    } else if (hasColors_ && !layout_.has(Column::Alpha)) {
      for (std::size_t i = 0; i < cloud.size(); ++i) cloud.colors[i][3] = 1;
    }
  }

 private:
  [[nodiscard]] double of(Column column) const { return values_[static_cast<std::size_t>(column)]; }

  static std::string printable(std::string text) {
    std::replace_if(
        text.begin(), text.end(), [](char c) { return c < ' ' || c > '~'; }, '?');
    return text.substr(0, 24);
  }

  void addColor(FilePosition place) {
    const Imath::V4d color(of(Column::Red), of(Column::Green), of(Column::Blue), of(Column::Alpha));
    for (int part = 0; part < 4; ++part) {
      requireColorPart(builder_.name(), place, color[part]);
      if (part < 3 || layout_.has(Column::Alpha)) exceedsOne_ = exceedsOne_ || color[part] > 1;
    }
    builder_.addColor(Imath::V4f(color), place);
  }

  Lines& lines_;
  CloudBuilder& builder_;
  Layout layout_;
  std::array<double, kColumns> values_ = {};
  bool hasNormals_ = false, hasColors_ = false, hasRadii_ = false, hasWeights_ = false;
  bool mayBeColors_ = true, exceedsOne_ = false;
};

enum class CommentKind { Names, Text, Unclear };

/// Decides if a comment names the columns. It has as many words as there are columns, and x, y and
/// z are among them.
CommentKind kindOf(std::string_view comment, const Layout& layout) {
  const auto& columns = layout.columns;
  const auto isIdentifier = [](const std::string& word) {
    return std::all_of(word.begin(), word.end(), [](char c) {
      return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '_';
    });
  };
  const std::vector<std::string> words = wordsOf(comment);
  const bool startsWithPosition = std::all_of(columns.begin(), columns.begin() + 3,
                                              [](Column column) { return column <= Column::Z; });
  if (startsWithPosition) return CommentKind::Names;
  if (columns[0] == Column::X && std::all_of(words.begin(), words.end(), isIdentifier))
    return CommentKind::Names;
  return comment.find_first_of(":=") != std::string_view::npos ? CommentKind::Text
                                                               : CommentKind::Unclear;
}

/// Finds the layout from the present line, and from the comment before it. Sets `isHeader` when the
/// line holds names, not a point.
Layout layoutOf(const Lines& lines, bool& isHeader) {
  std::array<double, kMostColumns> numbers;
  const std::optional<std::size_t> count = lines.numbers(numbers);
  isHeader = !count.has_value();
  if (isHeader) {
    if (auto layout = layoutOfNames(lines.line())) return *layout;
    lines.fail("the first line holds neither numbers nor the names x, y and z of columns");
  }
  if (auto layout = layoutOfNames(lines.comment()); layout && layout->columns.size() == *count) {
    const CommentKind kind = kindOf(lines.comment(), *layout);
    if (kind == CommentKind::Names) return *layout;
    if (kind == CommentKind::Unclear)
      lines.fail(
          "the comment before the line may name the columns or not; write the names into a line "
          "without '#' or '//', or remove the comment");
  }
  if (auto layout = layoutOfCount(*count, false)) return *layout;
  lines.fail(fmt::format(
      "the line has {} numbers, and only 3, 4, 6, 7 or 9 have a known meaning; name the columns "
      "in the first line",
      *count));
}

std::string attributeNames(const Layout& layout) {
  PointCloud held;
  if (layout.has(Column::Nx)) held.normals.resize(1);
  if (layout.has(Column::Red)) held.colors.resize(1);
  if (layout.has(Column::Radius)) held.radii.resize(1);
  if (layout.has(Column::Weight)) held.weights.resize(1);
  return layout.isUndecided ? "normals or colours" : describe(held);
}

std::optional<std::size_t> countOnLine(const Lines& lines) {
  std::array<double, kMostColumns> numbers;
  const std::optional<std::size_t> count = lines.numbers(numbers);
  if (count != std::size_t{1}) return std::nullopt;
  const double points = numbers[0];
  if (!(points >= 0 && points < 1e15) || std::floor(points) != points) return std::nullopt;
  return static_cast<std::size_t>(points);
}

/// Lines before the first point of an XYZ or CSV file.
struct XyzHeader {
  Layout layout = {};
  std::optional<std::size_t> promised = {};  ///< number of points, if a line gives it
  bool hasPoints = false;
};

/// Reads the lines before the first point, which is the present line afterwards. A line of names
/// and a line with the number of points may come in any order.
XyzHeader readXyzHeader(Lines& lines) {
  XyzHeader header;
  header.promised = countOnLine(lines);
  if (header.promised && !lines.next()) return header;
  bool isHeader = false;
  header.layout = layoutOf(lines, isHeader);
  if (isHeader && !lines.next()) return header;
  if (isHeader && !header.promised) {
    header.promised = countOnLine(lines);
    if (header.promised && !lines.next()) return header;
  }
  header.hasPoints = true;
  return header;
}

/// Reads the line with the number of points of a block of a PTS file.
std::size_t ptsCount(const Lines& lines, bool isFirst) {
  std::array<double, kMostColumns> numbers;
  if (const auto count = countOnLine(lines)) return *count;
  if (isFirst && lines.numbers(numbers).value_or(0) >= 3)
    failAt(lines.name(), lines.place(),
           "the number of points is missing; read the file with --format xyz, or write the number "
           "into the first line");
  lines.fail("the number of points is missing");
}

/// Writes the parts of colours as bytes. If no byte exceeds 1, they are written as fractions, since
/// readers would take the bytes for those.
class ColorText {
 public:
  ColorText(const PointCloud& cloud, bool withAlpha) : parts_(withAlpha ? 4 : 3) {
    asFractions_ = std::none_of(cloud.colors.begin(), cloud.colors.end(), [&](const auto& color) {
      for (int part = 0; part < parts_; ++part)
        if (colorByte(color[part]) > 1) return true;
      return false;
    });
  }
  void write(ByteWriter& out, const Imath::V4f& color, const char* separator) const {
    for (int part = 0; part < parts_; ++part) {
      const unsigned char byte = colorByte(color[part]);
      out.write(separator);
      if (asFractions_)
        out.writeNumber(static_cast<float>(byte) / 255);
      else
        out.writeNumber(std::uint64_t{byte});
    }
  }

 private:
  int parts_;
  bool asFractions_ = false;
};

/// Writes the points as lines. `names` begins the line of column names; null: no such line.
void writeLines(ByteWriter& out, const PointCloud& cloud, const Progress& progress,
                const char* separator, const char* names, bool hasMore) {
  const bool withAlpha = hasMore && hasAlpha(cloud);
  const auto join = [&](const char* text) { out.write(separator), out.write(text); };
  if (names) {
    out.write(names);
    out.write("x"), join("y"), join("z");
    if (!cloud.normals.empty()) join("nx"), join("ny"), join("nz");
    if (!cloud.colors.empty()) join("r"), join("g"), join("b");
    if (withAlpha) join("a");
    if (hasMore && !cloud.radii.empty()) join("radius");
    if (hasMore && !cloud.weights.empty()) join("weight");
    out.write("\n");
  }
  const ColorText colors(cloud, withAlpha);
  WriteProgress steps(progress, cloud.size());
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    for (int axis = 0; axis < 3; ++axis) {
      if (axis > 0) out.write(separator);
      out.writeNumber(cloud.positions[i][axis]);
    }
    for (int axis = 0; axis < (cloud.normals.empty() ? 0 : 3); ++axis) {
      out.write(separator);
      out.writeNumber(cloud.normals[i][axis]);
    }
    if (!cloud.colors.empty()) colors.write(out, cloud.colors[i], separator);
    if (hasMore && !cloud.radii.empty()) out.write(separator), out.writeNumber(cloud.radii[i]);
    if (hasMore && !cloud.weights.empty()) out.write(separator), out.writeNumber(cloud.weights[i]);
    out.write("\n");
    steps.step();
  }
}

}  // namespace

void readXyzPoints(std::string_view input, CloudBuilder& builder) {
  requireText(input, builder.name(), "XYZ or CSV");
  Lines lines(input, builder.name());
  if (!lines.next()) return;
  const XyzHeader header = readXyzHeader(lines);
  if (!header.hasPoints) return;
  PointLines points(lines, builder, header.layout);
  do {
    points.readLine();
  } while (lines.next());
  points.finish();
  if (header.promised && *header.promised != builder.cloud().size())
    failFile(builder.name(), fmt::format("promises {} points and holds {}; download or export it "
                                         "again",
                                         *header.promised, builder.cloud().size()));
}

void readPtsPoints(std::string_view input, CloudBuilder& builder) {
  requireText(input, builder.name(), "PTS");
  Lines lines(input, builder.name());
  std::optional<PointLines> points;
  std::size_t columns = 0;
  while (lines.next()) {
    const std::size_t count = ptsCount(lines, !points);
    if (count > input.size() / 6 + 1)
      lines.fail(fmt::format("the line promises {} points, more than the file can hold", count));
    for (std::size_t i = 0; i < count; ++i) {
      if (!lines.next())
        failFile(builder.name(),
                 fmt::format("ends after {} of {} points; it is truncated: download or export it "
                             "again",
                             i, count));
      std::array<double, kMostColumns> numbers;
      const std::optional<std::size_t> found = lines.numbers(numbers);
      if (!points) {
        if (!found) lines.fail("the line holds something other than numbers");
        const auto layout = layoutOfCount(*found, true);
        if (!layout)
          lines.fail(fmt::format("the line has {} numbers, and a point has 3, 4, 6 or 7", *found));
        columns = *found;
        points.emplace(lines, builder, *layout);
      }
      if (found == std::size_t{1} && columns != 1)
        lines.fail(fmt::format("only {} of {} points precede this line", i, count));
      points->readLine();
    }
  }
  if (points) points->finish();
}

PointFileInfo xyzPointInfo(std::string_view head, const std::string& name) {
  requireText(head, name, "XYZ or CSV");
  Lines lines(head, name);
  if (!lines.next()) failFile(name, "holds no points; export it again");
  const XyzHeader header = readXyzHeader(lines);
  return {"text", header.promised.value_or(0), attributeNames(header.layout)};
}

PointFileInfo ptsPointInfo(std::string_view head, const std::string& name) {
  requireText(head, name, "PTS");
  Lines lines(head, name);
  if (!lines.next()) failFile(name, "holds no points; export it again");
  PointFileInfo info{"pts", ptsCount(lines, true)};
  std::array<double, kMostColumns> numbers;
  if (lines.next())
    if (const auto found = lines.numbers(numbers))
      if (const auto layout = layoutOfCount(*found, true))
        info.attributes = attributeNames(*layout);
  return info;
}

void writeXyzPoints(ByteWriter& out, const PointCloud& cloud, const Progress& progress) {
  const bool hasNames = !cloud.normals.empty() || !cloud.colors.empty();
  writeLines(out, cloud, progress, " ", hasNames ? "# " : nullptr, false);
}

void writeCsvPoints(ByteWriter& out, const PointCloud& cloud, const Progress& progress) {
  writeLines(out, cloud, progress, ",", "", true);
}

void writePtsPoints(ByteWriter& out, const PointCloud& cloud, const Progress& progress) {
  out.writeNumber(std::uint64_t{cloud.size()});
  out.write("\n");
  const ColorText colors(cloud, false);
  WriteProgress steps(progress, cloud.size());
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    for (int axis = 0; axis < 3; ++axis) {
      if (axis > 0) out.write(" ");
      out.writeNumber(cloud.positions[i][axis]);
    }
    if (!cloud.colors.empty()) {
      out.write(" 0");
      colors.write(out, cloud.colors[i], " ");
    }
    out.write("\n");
    steps.step();
  }
}

}  // namespace levelset::point_files
