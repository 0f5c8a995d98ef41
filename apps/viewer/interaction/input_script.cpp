#include "apps/viewer/interaction/input_script.h"

#include <fmt/core.h>

#include <fstream>
#include <sstream>

#include "apps/pipeline/values/units.h"
#include "levelset/error.h"

namespace viewer {
namespace {

using Imath::V2d;
using Kind = InputStep::Kind;
using Words = std::vector<std::string>;

V2d placeOf(const std::string& word, const std::string& where) {
  const std::size_t comma = word.find(',');
  if (comma == std::string::npos)
    throw levelset::UsageError(
        fmt::format("{}: '{}' is not a position; give X,Y in pixels", where, word));
  return {pipeline::parseNumber(word.substr(0, comma), where),
          pipeline::parseNumber(word.substr(comma + 1), where)};
}

int buttonOf(const std::string& word, const std::string& where) {
  if (word == "left") return 0;
  if (word == "right") return 1;
  if (word == "middle") return 2;
  if (word == "shift") return InputStep::kShift;
  throw levelset::UsageError(
      fmt::format("{}: '{}' is not a button; give left, right, middle or shift", where, word));
}

void addDrag(const Words& words, const std::string& where, std::vector<InputStep>& steps) {
  constexpr int kSteps = 8;
  V2d from = placeOf(words[1], where);
  steps.push_back({.kind = Kind::Move, .place = from});
  steps.push_back({.kind = Kind::Press});
  for (std::size_t i = 2; i < words.size(); ++i) {
    const V2d to = placeOf(words[i], where);
    for (int step = 1; step <= kSteps; ++step)
      steps.push_back(
          {.kind = Kind::Move, .place = from + (to - from) * (static_cast<double>(step) / kSteps)});
    from = to;
  }
  steps.push_back({.kind = Kind::Release});
}

void addLine(const Words& words, const std::string& where, std::vector<InputStep>& steps) {
  const std::string& command = words[0];
  const auto needsWords = [&](std::size_t least, std::size_t most) {
    if (words.size() < least || words.size() > most)
      throw levelset::UsageError(
          fmt::format("{}: {} has a wrong number of values; see docs/viewer.md", where, command));
  };
  if (command == "drag") {
    needsWords(3, 1000);
    return addDrag(words, where, steps);
  }
  if (command == "click") {
    needsWords(2, 2);
    steps.push_back({.kind = Kind::Move, .place = placeOf(words[1], where)});
    steps.push_back({.kind = Kind::Press});
    steps.push_back({.kind = Kind::Release});
    return;
  }
  if (command == "wait" || command == "copied") {
    needsWords(1, 1);
    steps.push_back({.kind = command == "wait" ? Kind::Wait : Kind::Copied});
    return;
  }
  if (command != "move" && command != "press" && command != "release" && command != "key" &&
      command != "picture")
    throw levelset::UsageError(
        fmt::format("{}: '{}' is unknown; give move, press, release, click, drag, key, wait, "
                    "picture or copied",
                    where, command));
  needsWords(2, 2);
  if (command == "move")
    steps.push_back({.kind = Kind::Move, .place = placeOf(words[1], where)});
  else if (command == "key" || command == "picture")
    steps.push_back({.kind = command == "key" ? Kind::Key : Kind::Picture, .text = words[1]});
  else
    steps.push_back({.kind = command == "press" ? Kind::Press : Kind::Release,
                     .button = buttonOf(words[1], where)});
}

}  // namespace

std::vector<InputStep> readInputScript(const std::filesystem::path& file) {
  std::ifstream stream(file);
  if (!stream)
    throw levelset::IoError(
        fmt::format("levelsmith-view: --play: '{}' cannot be read; check its name", file.string()));
  std::vector<InputStep> steps;
  std::string line;
  for (int number = 1; std::getline(stream, line); ++number) {
    std::istringstream text(line.substr(0, line.find('#')));
    Words words;
    for (std::string word; text >> word;) words.push_back(word);
    if (!words.empty())
      addLine(words, fmt::format("levelsmith-view: --play: {}:{}", file.string(), number), steps);
  }
  return steps;
}

}  // namespace viewer
