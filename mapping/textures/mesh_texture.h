#pragma once

#include <Imath/ImathBox.h>

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "levelset/mesh.h"
#include "levelset/progress.h"
#include "mapping/distortion/distortion.h"
#include "mapping/distortion/fold_certificate.h"
#include "mapping/patches/patch.h"

namespace mapping {

struct MeshTextureOptions {
  double embedDepth = 0;  ///< how deep the texture dips below the surface, world units
  std::optional<Imath::Box3d> textureBox =
      {};  ///< what the unit cube of u, v, w is; empty: the mesh's own box
  bool allowFolds = false;
  bool skipFolds = false;  ///< of many patches, leave out those that fold
  std::size_t maxMemory = levelset::kNoMemoryLimit;
  levelset::Progress progress = {};
};

struct MeshTextureResult {
  levelset::TriMesh mesh;
  Distortion distortion;  ///< in the middle and close to the corners of the particles' cells
  FoldCertificate certificate;
  std::size_t skipped = 0;      ///< patches left out because they fold
  std::size_t lostNormals = 0;  ///< that had no direction, or have none on the patch: zero
  std::vector<std::string> notes;
};

/// Moves the vertices of a mesh from texture space onto a patch, straight between its particles:
/// within the two layers about w first, then from one to the other [Brodersen07 §8.4]. Any mesh
/// will do, closed or not; its triangles stay, turned over where the patch is mirrored so that they
/// face as before. Beyond the unit cube the outermost cells go on.
/// Normals follow by the inverse transpose of the map's derivatives in the cell of their vertex (on
/// a border, in the one that begins there), at unit length and on the same side of the triangles;
/// those of length zero stay so, with a note. Texture coordinates and colours are copied.
/// @throws UsageError for a sink that is not finite; InvalidInput when the mesh is empty, its box
///         has no volume, its attributes do not fit its vertices or are not finite, or the patch
///         folds; ResourceLimit; Cancelled
[[nodiscard]] MeshTextureResult mapMesh(const levelset::TriMesh& texture, const Patch& patch,
                                        const MeshTextureOptions& options = {});

/// The same mesh on each of many patches, one after the other in one mesh.
/// @throws as above; UsageError when there is no patch
[[nodiscard]] MeshTextureResult mapMesh(const levelset::TriMesh& texture,
                                        std::span<const Patch> patches,
                                        const MeshTextureOptions& options = {});

}  // namespace mapping
