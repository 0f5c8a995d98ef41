#include "apps/pipeline/operators/pictures/segmented_pictures.h"

#include <fmt/core.h>

#include <algorithm>
#include <vector>

#include "apps/pipeline/operators/label_params.h"
#include "levelset/error.h"
#include "render/segmented/segmented_part.h"

namespace pipeline {
namespace {

using levelset::RegionLabel;
using levelset::UsageError;

std::vector<RegionLabel> hiddenLabels(const Invocation& in) {
  if (!in.given("hide")) return {};
  return regionLabels(in, "hide", VoidLabel::IsNone);
}

}  // namespace

Param hideParam() {
  return {.name = "hide",
          .type = ParamType::Text,
          .doc =
              "for a segmentation: labels of regions that are not drawn, separated by commas, so "
              "that interfaces and sheets inside them show"};
}

void validateHide(const Invocation& in) {
  if (!in.given("hide")) return;
  (void)hiddenLabels(in);
  if (!in.operands.empty() && in.operands[0].kind() != Kind::Segmentation)
    throw UsageError("render: --hide is for segmentations; leave it out");
}

render::ViewedScene segmentedScene(Invocation& in) {
  const levelset::SegmentedField& field = in.operands[0].segmentation();
  if (field.isEmpty())
    throw levelset::InvalidInput("the segmentation has no interface, so nothing can be drawn");
  const std::vector<RegionLabel> hidden = hiddenLabels(in), known = field.labels();
  for (const RegionLabel label : hidden)
    if (!std::binary_search(known.begin(), known.end(), label))
      throw levelset::InvalidInput(
          fmt::format("the segmentation has no region {} to hide; 'info' lists its labels", label));
  render::InterfaceCaster caster(field, hidden, in.maxMemory);
  if (caster.bounds().isEmpty())
    throw levelset::InvalidInput("--hide names all regions, so nothing is drawn; leave one out");
  render::ViewedScene viewed;
  viewed.scene.segmented = render::SegmentedPart{caster};
  return viewed;
}

}  // namespace pipeline
