#include "apps/pipeline/operators/pictures/molecule_pictures.h"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <utility>

#include "levelset/error.h"
#include "render/quadrics/quadric_part.h"
#include "render/shading/style.h"

namespace pipeline {
namespace {

using levelset::MoleculeColour;
using levelset::MoleculeStyle;
using levelset::UsageError;

constexpr std::array<std::pair<const char*, MoleculeStyle>, 4> kMoleculeStyles = {
    {{"ball-and-stick", MoleculeStyle::BallAndStick},
     {"balls", MoleculeStyle::Balls},
     {"sticks", MoleculeStyle::Sticks},
     {"van-der-waals", MoleculeStyle::VanDerWaals}}};
constexpr std::array<std::pair<const char*, MoleculeColour>, 4> kMoleculeColours = {
    {{"element", MoleculeColour::Element},
     {"chain", MoleculeColour::Chain},
     {"residue", MoleculeColour::Residue},
     {"b-factor", MoleculeColour::BFactor}}};

template <typename Names>
std::vector<std::string> namesOfChoices(const Names& choices) {
  std::vector<std::string> names;
  for (const auto& choice : choices) names.emplace_back(choice.first);
  return names;
}
template <typename Names>
auto choiceNamed(const Names& choices, const std::string& name) {
  const auto found = std::find_if(choices.begin(), choices.end(),
                                  [&](const auto& choice) { return choice.first == name; });
  return found == choices.end() ? choices.front().second : found->second;
}

std::uint32_t packedSrgb(const Imath::C3f& colour) {
  return render::packedColour({render::linearFromSrgb(colour.x), render::linearFromSrgb(colour.y),
                               render::linearFromSrgb(colour.z)});
}

}  // namespace

std::vector<std::string> moleculeStyleNames() {
  return namesOfChoices(kMoleculeStyles);
}

MoleculeStyle moleculeStyleNamed(const std::string& name) {
  return choiceNamed(kMoleculeStyles, name);
}

std::vector<Param> moleculeModelParams(const std::string& of) {
  return {
      {.name = "ball-scale",
       .type = ParamType::Number,
       .doc = of + "radius of small balls, as a share of the van der Waals radius, at most 1; no "
                   "ball is thinner than a stick",
       .fallback = "0.25",
       .range = Range::Positive},
      {.name = "stick-radius",
       .type = ParamType::Length,
       .doc = of + "radius of the sticks",
       .fallback = "0.15",
       .range = Range::Positive,
       .allowsVoxels = false},
      {.name = "file-bonds",
       .type = ParamType::Flag,
       .doc = of + "use only the bonds of the file"}};
}

void validateMoleculeModel(const Invocation& in, const std::string& style) {
  const MoleculeStyle of = moleculeStyleNamed(in.text(style));
  const auto refuse = [&](const char* option, bool isUsed) {
    if (in.given(option) && !isUsed)
      throw UsageError(fmt::format("{}: --{} does not apply to --{} {}; leave it out", in.op().name,
                                   option, style, in.text(style)));
  };
  refuse("ball-scale", of == MoleculeStyle::Balls || of == MoleculeStyle::BallAndStick);
  refuse("stick-radius", levelset::hasMoleculeSticks(of));
  refuse("file-bonds", levelset::hasMoleculeSticks(of));
}

levelset::MoleculeModelOptions moleculeModelOptions(Invocation& in, const std::string& style) {
  return {.style = moleculeStyleNamed(in.text(style)),
          .ballScale = in.number("ball-scale"),
          .stickRadius = in.length("stick-radius"),
          .bonds = {.isByDistance = !in.flag("file-bonds")},
          .maxMemory = in.maxMemory};
}

std::vector<Param> moleculePictureParams() {
  std::vector<Param> params = {
      {.name = "atoms",
       .type = ParamType::Choice,
       .doc = "for a molecule: how atoms and bonds are drawn; see 'molecule-model'",
       .fallback = "ball-and-stick",
       .choices = moleculeStyleNames()},
      {.name = "colour-by",
       .type = ParamType::Choice,
       .doc = "for a molecule: property of the atoms that gives the colours",
       .fallback = "element",
       .choices = namesOfChoices(kMoleculeColours)},
      {.name = "blue-at",
       .type = ParamType::Number,
       .doc = "with --colour-by b-factor: temperature factor that is blue; default: the least one"},
      {.name = "red-at",
       .type = ParamType::Number,
       .doc = "with --colour-by b-factor: temperature factor that is red; default: the largest "
              "one"}};
  for (Param& param : moleculeModelParams("for a molecule: ")) params.push_back(std::move(param));
  return params;
}

void validateMoleculePicture(const Invocation& in) {
  if (in.operands.empty()) return;
  const bool isMolecule = in.operands[0].kind() == Kind::Molecule;
  for (const Param& param : moleculePictureParams())
    if (in.given(param.name) && !isMolecule)
      throw UsageError(fmt::format("render: --{} is for molecules; leave it out", param.name));
  if (!isMolecule) return;
  validateMoleculeModel(in, "atoms");
  for (const char* end : {"blue-at", "red-at"})
    if (in.given(end) && in.text("colour-by") != "b-factor")
      throw UsageError(fmt::format("render: --{} is for --colour-by b-factor; leave it out", end));
  if (in.given("blue-at") != in.given("red-at"))
    throw UsageError("render: one end of the colour scale is missing; give --blue-at and --red-at");
}

render::ViewedScene moleculeScene(Invocation& in) {
  levelset::MoleculeModelOptions options = moleculeModelOptions(in, "atoms");
  options.colour = choiceNamed(kMoleculeColours, in.text("colour-by"));
  if (in.given("blue-at")) options.bFactors = {in.number("blue-at"), in.number("red-at")};
  const levelset::MoleculeModel model = levelset::moleculeModel(in.operands[0].molecule(), options);
  std::vector<render::Ball> balls;
  balls.reserve(model.balls.size());
  for (const levelset::ModelBall& ball : model.balls)
    balls.push_back({model.origin + Imath::V3d(ball.centre), ball.radius, packedSrgb(ball.colour)});
  std::vector<render::Stick> sticks;
  sticks.reserve(model.sticks.size());
  for (const levelset::ModelStick& stick : model.sticks)
    sticks.push_back({model.origin + Imath::V3d(stick.from), model.origin + Imath::V3d(stick.to),
                      stick.radius, packedSrgb(stick.colour)});
  render::ViewedScene viewed;
  viewed.scene.quadrics.push_back(
      render::makeQuadricPart(std::move(balls), std::move(sticks), "molecule", in.maxMemory));
  return viewed;
}

}  // namespace pipeline
