#pragma once

#include <Imath/ImathBox.h>

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "levelset/fields/grid.h"
#include "levelset/mesh.h"
#include "levelset/narrow_band.h"
#include "levelset/operator/plan.h"
#include "mapping/animation/animation.h"
#include "mapping/patches/patch.h"
#include "render/views/scene_file.h"

namespace pipeline {

enum class Kind {
  Mesh,
  Band,
  Patch,
  Field,
  Surface,  ///< a band about an open surface: a base for patches
  Scene
};
[[nodiscard]] const char* kindName(Kind kind);

/// What is known of a value before it is computed: enough to resolve lengths and estimate cost.
struct Plan {
  Kind kind = Kind::Band;
  Imath::Box3d bounds = {};  ///< of the zero set or the vertices, world units
  double area = 0;           ///< of the surface, world units²
  double voxelSize = 0;      ///< bands only, of solids or surfaces
  double halfWidth = 0;      ///< voxels, bands only
  double fieldBytes = 0;     ///< fields only
  double triangles = 0;      ///< meshes only; 0: not known
  /// Patches only: along u, along v, and the height, 0 where only the texture will tell.
  Imath::V3d patchSize = Imath::V3d(0);
  double patchCount = 1;

  /// The estimates that operators of levelset read.
  [[nodiscard]] levelset::ValuePlan estimate() const;
  void set(const levelset::ValuePlan& estimate);
  /// Active voxels that a band of this area takes.
  [[nodiscard]] double activeVoxels() const;
  [[nodiscard]] double bytes() const;
};

/// How patches were made, for whoever makes them again on another base or in another place.
struct PatchRecipe {
  /// What of them is to be carried, and how to make them there.
  std::function<std::vector<mapping::PatchOutline>(const std::vector<mapping::Patch>&)> outlines =
      {};
  mapping::PatchMaker make = {};
  /// In place of the two: of patches that an axis tells, which stay about it.
  std::function<std::vector<mapping::Patch>(const levelset::NarrowBand& base, double height,
                                            const levelset::Progress& progress)>
      around = {};
  bool isRigid = false;    ///< centre and direction tell all of it, as of a decal
  std::string fixed = {};  ///< why it cannot be moved; empty: it can
  std::string action = {};
  /// Its options but for the place and the height, as far as they shape the patch, and as far as
  /// they only tell how finely it is made.
  std::map<std::string, std::string> shape = {}, fineness = {};
};

/// One patch or many of one base.
struct PatchValue {
  std::vector<mapping::Patch> patches;
  /// With `--height auto`: makes them once the texture has told the height. Empty otherwise.
  std::function<std::vector<mapping::Patch>(double height, const levelset::Progress&)> atHeight =
      {};
  std::shared_ptr<const PatchRecipe> recipe = {};  ///< of those from files: none
};

/// What flows through a chain: immutable, cheap to copy. In a dry run only the plan is there.
class Value {
 public:
  explicit Value(levelset::TriMesh mesh);
  explicit Value(levelset::NarrowBand band);
  explicit Value(PatchValue patch);
  explicit Value(levelset::FieldGrid field);
  explicit Value(render::ViewedScene scene);
  explicit Value(Plan plan);

  [[nodiscard]] Kind kind() const;
  // The value as that kind. A file may turn out to hold another kind than its name promised.
  // @throws levelset::UsageError when it is of another kind
  [[nodiscard]] const levelset::TriMesh& mesh() const;
  [[nodiscard]] const levelset::NarrowBand& band() const;
  [[nodiscard]] const PatchValue& patch() const;
  [[nodiscard]] const levelset::FieldGrid& field() const;
  [[nodiscard]] const render::ViewedScene& scene() const;

  /// Known, or read off the value and remembered.
  [[nodiscard]] const Plan& plan() const;
  [[nodiscard]] double diagonal() const {
    return plan().bounds.isEmpty() ? 0 : plan().bounds.size().length();
  }

 private:
  template <typename T>
  [[nodiscard]] const T& as(Kind wanted) const;

  std::variant<std::monostate, std::shared_ptr<const levelset::TriMesh>, levelset::NarrowBand,
               std::shared_ptr<const PatchValue>, levelset::FieldGrid,
               std::shared_ptr<const render::ViewedScene>>
      data_;
  mutable std::optional<Plan> plan_;
};

/// A level set, a mesh or a scene as what is drawn of it. Not beyond the value's life.
[[nodiscard]] render::ViewedScene sceneOf(const Value& drawn);

}  // namespace pipeline
