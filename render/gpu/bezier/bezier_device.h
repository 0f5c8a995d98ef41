#pragma once

// Private to the GPU renderer: memory of the ray casting of Bézier volumes in an OpenGL context.

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstring>
#include <memory>
#include <span>
#include <vector>

#include "render/bezier/tree_node.h"
#include "render/gpu/bezier/bezier_programs.h"
#include "render/gpu/bezier/gpu_beziers.h"
#include "render/gpu/device/gl_objects.h"

namespace render {

inline constexpr std::size_t kPairBytes = 12;     // node, ray, and the pair with the shared node
inline constexpr std::size_t kListCounters = 16;  // in front of the lists of nodes

/// Makes room without a reserve, so that the memory stays within limits.
inline void fitBuffer(const GlContext& context, GrowingBuffer& buffer, std::size_t bytes) {
  if (bytes <= buffer.capacity()) return;
  buffer.release(context);
  buffer.reserve(context, bytes);
}

/// Nodes of one level of the tree, with the pairs that they have not decided.
struct BezierLevel {
  GrowingBuffer points{GrowingBuffer::Use::Upload}, heads{GrowingBuffer::Use::Upload},
      marks{GrowingBuffer::Use::Upload}, lists{GrowingBuffer::Use::Upload},
      slots{GrowingBuffer::Use::Upload}, parents{GrowingBuffer::Use::Upload},
      rest{GrowingBuffer::Use::Upload};
  std::size_t nodes = 0;  ///< capacity
  std::size_t used = 0;

  [[nodiscard]] std::array<GrowingBuffer*, 7> buffers() {
    return {&points, &heads, &marks, &lists, &slots, &parents, &rest};
  }
  [[nodiscard]] std::size_t bytes() {
    std::size_t sum = 0;
    for (const GrowingBuffer* buffer : buffers()) sum += buffer->capacity();
    return sum;
  }
};

inline std::size_t bytesOfNode(std::size_t pointBytes) {
  return pointBytes + 8 * kBezierHead + 4 * (2 + 3 + 1 + 1);
}

/// Objects in the context, and their limits.
class GpuBeziers::Device {
 public:
  Device(const GlContext& context_, std::size_t mostBytes_)
      : context(context_), gl(context_.gl()), programs(context_), mostBytes(mostBytes_) {}

  template <int N>
  class Run;

  const GlContext& context;
  const GlFunctions& gl;
  BezierPrograms programs;
  const std::size_t mostBytes;
  std::size_t blockBytes = 0;
  GpuBezierCounts counts;
  std::array<GrowingBuffer, 2> pairs{GrowingBuffer(GrowingBuffer::Use::Device),
                                     GrowingBuffer(GrowingBuffer::Use::Device)};
  GrowingBuffer rays{GrowingBuffer::Use::Upload}, visits{GrowingBuffer::Use::Upload},
      view{GrowingBuffer::Use::Upload}, roots{GrowingBuffer::Use::Device},
      states{GrowingBuffer::Use::Device}, fetched{GrowingBuffer::Use::Fetch};
  std::vector<std::unique_ptr<BezierLevel>> levels;
  std::size_t pointBytes = 0;  ///< size of a node in `levels`

  [[nodiscard]] std::array<GrowingBuffer*, 8> common() {
    return {&pairs[0], &pairs[1], &rays, &visits, &view, &roots, &states, &fetched};
  }
  [[nodiscard]] std::size_t bytes() {
    std::size_t sum = 0;
    for (const GrowingBuffer* buffer : common()) sum += buffer->capacity();
    for (const auto& level : levels) sum += level->bytes();
    return sum;
  }
  [[nodiscard]] std::size_t free() {
    const std::size_t used = bytes();
    return used < mostBytes ? mostBytes - used : 0;
  }
  /// Pairs that are solved in one call.
  [[nodiscard]] std::size_t slice(int components) const {
    return std::clamp<std::size_t>(
        mostBytes / 8 / (8 * (bezierRootNumbers(components) + kBezierStates)), 64, 32768);
  }
  [[nodiscard]] std::size_t fetchBytes() const {
    return std::clamp<std::size_t>(mostBytes / 16, 1u << 16, 8u << 20);
  }

  BezierLevel& level(std::size_t depth) {
    while (levels.size() <= depth) levels.push_back(std::make_unique<BezierLevel>());
    return *levels[depth];
  }
  void releaseLevels() {
    for (const auto& level : levels)
      for (GrowingBuffer* buffer : level->buffers()) buffer->release(context);
    levels.clear();
  }
  /// Frees the levels from a depth on, and the lists of pairs. @pre they are not in use
  void releaseFrom(std::size_t depth) {
    for (std::size_t n = depth; n < levels.size(); ++n) {
      for (GrowingBuffer* buffer : levels[n]->buffers()) buffer->release(context);
      levels[n]->nodes = 0;
    }
    for (GrowingBuffer& list : pairs) list.release(context);
  }
  void release() {
    releaseLevels();
    for (GrowingBuffer* buffer : common()) buffer->release(context);
    programs.release();
  }
  void notePeak() { counts.peakBytes = std::max(counts.peakBytes, bytes()); }

  /// Makes room for nodes, and for lists of them.
  void fitNodes(BezierLevel& level, std::size_t nodes) {
    level.used = nodes;
    if (nodes > level.nodes) {
      for (GrowingBuffer* buffer : level.buffers())
        if (buffer != &level.rest) buffer->release(context);
      level.points.reserve(context, nodes * pointBytes);
      level.heads.reserve(context, nodes * 8 * kBezierHead);
      level.marks.reserve(context, nodes * 8);
      level.lists.reserve(context, 4 * (kListCounters + 3 * nodes));
      level.slots.reserve(context, nodes * 4);
      level.parents.reserve(context, nodes * 4);
      level.nodes = nodes;
    }
    notePeak();
  }
  /// Bytes that a list of the level at a depth may take now. Each level below keeps the room for
  /// one part of the least size.
  [[nodiscard]] std::size_t share(std::size_t depth) {
    constexpr std::size_t kLeastPairs = 512;
    const std::size_t least = 8 * bytesOfNode(pointBytes) + kLeastPairs * kPairBytes,
                      below = (kDeepestLevel - std::min<std::size_t>(depth, kDeepestLevel)) * least,
                      all = free();
    return all > below + 4 * least ? (all - below) / 4 : std::min(all / 4, least);
  }
  /// Largest numbers of nodes and pairs that the level at a depth may have now.
  [[nodiscard]] std::size_t mostNodes(std::size_t depth) {
    return std::min(level(depth).nodes + share(depth) / bytesOfNode(pointBytes),
                    blockBytes / std::max(pointBytes, 8 * kBezierHead));
  }
  [[nodiscard]] std::size_t mostPairs(std::size_t depth) {
    const std::size_t each = std::min(pairs[0].capacity(), pairs[1].capacity()) / kPairBytes;
    return std::min({each + share(depth) / (2 * kPairBytes),
                     (level(depth).rest.capacity() + share(depth)) / kPairBytes,
                     blockBytes / kPairBytes});
  }

  template <typename Number>
  void upload(const GrowingBuffer& buffer, std::span<const Number> numbers, std::size_t first = 0) {
    if (numbers.empty()) return;
    gl.NamedBufferSubData(buffer.name(), static_cast<GLintptr>(first * sizeof(Number)),
                          static_cast<GLsizeiptr>(numbers.size_bytes()), numbers.data());
  }
  /// Reads numbers of a buffer.
  template <typename Number>
  void download(const GrowingBuffer& buffer, std::size_t first, std::span<Number> numbers) {
    const std::size_t most = fetched.capacity() / sizeof(Number);
    for (std::size_t at = 0; at < numbers.size(); at += most) {
      const std::size_t bytes = std::min(most, numbers.size() - at) * sizeof(Number);
      gl.MemoryBarrier(GL_BUFFER_UPDATE_BARRIER_BIT);
      gl.CopyNamedBufferSubData(buffer.name(), fetched.name(),
                                static_cast<GLintptr>((first + at) * sizeof(Number)), 0,
                                static_cast<GLsizeiptr>(bytes));
      gl.MemoryBarrier(GL_CLIENT_MAPPED_BUFFER_BARRIER_BIT);
      gl.Finish();
      std::memcpy(numbers.data() + at, fetched.mapped(), bytes);
    }
    context.check("casting rays through Bézier volumes");
  }
};

}  // namespace render
