#pragma once

// Private to the GPU renderer: searches along rays for the surface of a blended scene.

#include <cstddef>
#include <vector>

#include "render/gpu/device/gl_context.h"
#include "render/gpu/device/gl_objects.h"
#include "render/kernel/field_traversal.h"

namespace render {

/// The fields of a blended scene in an OpenGL context, and the shader that searches them. The
/// shader is written for the scene's expression: it has the steps of the expression as statements.
class GpuFields {
 public:
  /// Largest numbers of fields and of steps in an expression.
  static constexpr std::size_t kMostFields = 8, kMostJoins = 24;

  /// Uploads the fields. Runs in a job of GlContext::run().
  /// @param context  must outlive this object
  /// @param largestTable  limit on the size of a buffer texture, bytes
  /// @throws levelset::ResourceLimit for an expression of more fields or steps than the limits, and
  /// when the fields do not fit into the buffer textures
  GpuFields(const GlContext& context, const FieldTraversal& fields, std::size_t largestTable);
  GpuFields(const GpuFields&) = delete;
  GpuFields& operator=(const GpuFields&) = delete;
  /// Frees all objects in the context. Runs in a job of GlContext::run().
  void release();

  /// Answers as FieldTracer::search(). @pre `fields` has the grids that were uploaded
  [[nodiscard]] std::vector<double> search(const FieldTraversal& fields,
                                           const std::vector<FieldSegment>& segments,
                                           FieldQuestion question);

 private:
  void upload(const FieldGrid& grid);
  /// Runs in a job of GlContext::run(). @param input  the rays, as the shader reads them
  void run(const FieldExpression& expression, const std::vector<double>& numbers,
           const std::vector<double>& input, FieldQuestion question, std::vector<double>& answers);

  const GlContext& context_;
  std::size_t largestTable_;
  std::vector<Texels> tables_;  // pages, entries, ranges and values of each grid
  GrowingBuffer numbers_{GrowingBuffer::Use::Upload}, rays_{GrowingBuffer::Use::Upload},
      found_{GrowingBuffer::Use::Device}, fetched_{GrowingBuffer::Use::Fetch};
  GLuint program_ = 0;
};

}  // namespace render
