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

std::vector<Param> moleculePictureParams() {
  return {{.name = "atoms",
           .type = ParamType::Choice,
           .doc = "for a molecule: how atoms and bonds are drawn; see 'molecule-model'",
           .fallback = "ball-and-stick",
           .choices = moleculeStyleNames()},
          {.name = "colour-by",
           .type = ParamType::Choice,
           .doc = "for a molecule: property of the atoms that gives the colours",
           .fallback = "element",
           .choices = namesOfChoices(kMoleculeColours)}};
}

void validateMoleculePicture(const Invocation& in) {
  if (in.operands.empty() || in.operands[0].kind() == Kind::Molecule) return;
  for (const char* name : {"atoms", "colour-by"})
    if (in.given(name))
      throw UsageError(fmt::format("render: --{} is for molecules; leave it out", name));
}

render::ViewedScene moleculeScene(Invocation& in) {
  const levelset::MoleculeModel model = levelset::moleculeModel(
      in.operands[0].molecule(), {.style = moleculeStyleNamed(in.text("atoms")),
                                  .colour = choiceNamed(kMoleculeColours, in.text("colour-by")),
                                  .maxMemory = in.maxMemory});
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
