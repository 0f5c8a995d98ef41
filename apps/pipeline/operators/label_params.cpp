#include "apps/pipeline/operators/label_params.h"

#include <fmt/core.h>

#include <algorithm>
#include <charconv>
#include <sstream>

#include "levelset/error.h"

namespace pipeline {

using levelset::RegionLabel;
using levelset::UsageError;

RegionLabel regionLabel(const std::string& text, VoidLabel voidLabel, const Invocation& in,
                        const char* param) {
  const bool countsVoid = voidLabel == VoidLabel::Counts;
  if (countsVoid && text == "void") return levelset::kVoid;
  RegionLabel label = 0;
  const char* last = text.data() + text.size();
  const auto [end, error] = std::from_chars(text.data(), last, label);
  if (error != std::errc() || end != last || (label == levelset::kVoid && !countsVoid))
    throw UsageError(fmt::format("{}: '{}' is not a label; give an integer from {} to 65535",
                                 in.where(param), text, countsVoid ? 0 : 1));
  return label;
}

std::vector<std::string> labelWords(const Invocation& in, const char* param) {
  std::string text = in.text(param);
  std::replace(text.begin(), text.end(), ',', ' ');
  std::istringstream stream(text);
  std::vector<std::string> words;
  for (std::string word; stream >> word;) words.push_back(word);
  if (words.empty())
    throw UsageError(
        fmt::format("{}: no label is given; give integers up to 65535", in.where(param)));
  return words;
}

std::vector<RegionLabel> regionLabels(const Invocation& in, const char* param,
                                      VoidLabel voidLabel) {
  std::vector<RegionLabel> labels;
  for (const std::string& word : labelWords(in, param))
    labels.push_back(regionLabel(word, voidLabel, in, param));
  return labels;
}

}  // namespace pipeline
