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

/// Maps from texture coordinates to positions above a patch.
enum class MeshMap {
  /// Layer map: bilinear within the two layers next to w, then linear between them.
  Layers,
  /// Inverse of PrismMap: linear in the tetrahedra between the particles, as TextureMap::Prism.
  Prisms
};

struct MeshTextureOptions {
  MeshMap map = MeshMap::Layers;
  double embedDepth = 0;  ///< depth of the texture below the surface, world units
  /// Box that is mapped to the unit cube of u, v, w; empty: the mesh's own box.
  std::optional<Imath::Box3d> textureBox = {};
  bool allowFolds = false;
  /// Leaves out patches whose map folds. Throws an error if no patch is left.
  bool skipFolds = false;
  std::size_t maxMemory = levelset::kNoMemoryLimit;
  levelset::Progress progress = {};
};

struct MeshTextureResult {
  levelset::TriMesh mesh;
  Distortion distortion;  ///< sampled in the cells of particles, or in each tetrahedron
  FoldCertificate certificate;
  std::size_t skipped = 0;      ///< patches left out because they fold
  std::size_t lostNormals = 0;  ///< number of normals of length zero, in the input or after mapping
  std::vector<std::string> notes;
};

/// Moves the vertices of a mesh from texture space onto a patch, piecewise linearly through its
/// particles. MeshMap::Layers is bilinear in u and v within the two layers next to w, then linear
/// between them [Brodersen07 §8.4]. MeshMap::Prisms is linear in tetrahedra [Brodersen07 §9.3], and
/// the exact inverse of the map of a solid under TextureMap::Prism. Each vertex costs the same for
/// any number of particles, because tetrahedra are found by their indices. The mesh may be open or
/// closed. Its triangles are kept; if the patch is mirrored, their vertex order is reversed, so
/// that they still face the same side of the texture. Beyond the unit cube the outermost cells
/// continue linearly. Normals are transformed by the inverse transpose of the map's Jacobian in the
/// cell of their vertex. On the border of two cells, that is the cell that begins there. Mapped
/// normals get unit length and stay on the same side of the triangles. Normals of length zero stay
/// zero, with a note. Texture coordinates and colours are copied.
/// @throws UsageError for an embedding depth that is not finite
/// @throws InvalidInput if the mesh is empty, its box has no volume, its attributes do not match
///         its vertices or are not finite, or the patch folds
/// @throws ResourceLimit if the memory estimate exceeds `maxMemory`
/// @throws Cancelled if the progress callback cancels
[[nodiscard]] MeshTextureResult mapMesh(const levelset::TriMesh& texture, const Patch& patch,
                                        const MeshTextureOptions& options = {});

/// Maps the same mesh onto each of many patches, joined into one mesh.
/// @throws UsageError as above, and if there is no patch
/// @throws InvalidInput, ResourceLimit, Cancelled as above
[[nodiscard]] MeshTextureResult mapMesh(const levelset::TriMesh& texture,
                                        std::span<const Patch> patches,
                                        const MeshTextureOptions& options = {});

}  // namespace mapping
