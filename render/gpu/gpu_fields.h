#pragma once

// Private to the GPU renderer: searches along rays for the surface of a blended scene.

#include <cstddef>
#include <vector>

#include "render/gpu/gl_context.h"
#include "render/gpu/gl_objects.h"
#include "render/kernel/field_traversal.h"

namespace render {

/// The fields of a blended scene in an OpenGL context, and the shader that searches them. The
/// shader is written for the scene's expression: it has the steps of the expression as statements.
class GpuFields {
 public:
  /// Largest numbers of fields and of steps in an expression.
  static constexpr std::size_t kMostFields = 8, kMostJoins = 24;

  /// Uploads the fields. @pre the context is current
  /// @param context  must outlive this object
  /// @param largestTable  limit on the size of a buffer texture, bytes
  /// @throws levelset::ResourceLimit for an expression of more fields or steps than the limits, and
  /// when the fields do not fit into the buffer textures
  GpuFields(const GlContext& context, const FieldTraversal& fields, std::size_t largestTable);
  GpuFields(const GpuFields&) = delete;
  GpuFields& operator=(const GpuFields&) = delete;
  /// Frees all objects in the context. @pre the context is current
  void release();

  /// Answers as FieldTracer::search(). @pre `fields` has the grids that were uploaded
  [[nodiscard]] std::vector<double> search(const FieldTraversal& fields,
                                           const std::vector<FieldSegment>& segments,
                                           FieldQuestion question);

 private:
  void upload(const FieldGrid& grid);

  const GlContext& context_;
  std::size_t largestTable_;
  std::vector<Texels> tables_;  // pages, entries, ranges and values of each grid
  GLuint numbers_ = 0, rays_ = 0, found_ = 0, program_ = 0;
};

}  // namespace render
