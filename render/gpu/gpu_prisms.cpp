#include "render/gpu/gpu_prisms.h"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <mutex>
#include <span>
#include <string>
#include <tuple>

#include "levelset/convert/mesh_to_band.h"
#include "levelset/convert/mesh_to_band_input.h"
#include "levelset/convert/pseudonormals.h"
#include "levelset/convert/surface_blocks.h"
#include "levelset/error.h"
#include "render/gpu/device/gl_objects.h"

namespace render {
namespace {

using Imath::V3d;
using Imath::V3i;
using levelset::convert::LocalMesh;
using levelset::convert::PrismCovering;

// Blocks of a dispatch, few enough to finish within the time limits of drivers.
constexpr std::size_t kBlocksPerRun = 1024;
// Numbers of a triangle: corners, normal, outward directions, slopes and shifts of the halves,
// margin, and pseudonormals of corners, edges and face.
constexpr std::size_t kTriangleNumbers = 9 + 3 + 9 + 6 + 6 + 1 + 21;

constexpr const char* kPrismShader = R"GLSL(
layout(local_size_x = 64) in;
uniform int firstBlock;
layout(std430, binding = 0) readonly buffer Triangles { double numbers[]; };
layout(std430, binding = 1) readonly buffer Blocks { int blocks[]; };  // origin, first and end in lists
layout(std430, binding = 2) readonly buffer Lists { int lists[]; };
layout(std430, binding = 3) readonly buffer Reach { double reach; };
layout(std430, binding = 4) writeonly buffer Distances { float distances[]; };

double rowX, rowY;    // of this invocation's row, relative to the centre of the block
double low, high;     // part of the row in a half of a prism
double bestSquared[8];
double bestSide[8];   // positive in front of the closest point

dvec3 vectorAt(int at) { return dvec3(numbers[at], numbers[at + 1], numbers[at + 2]); }

// Leaves the part of the row with normal · p <= limit.
void cut(dvec3 normal, double limit) {
  double rest = limit - normal.x * rowX - normal.y * rowY;
  if (abs(normal.z) < 1e-9lf) {
    if (rest < 0.0lf) high = low - 1.0lf;
  } else if (normal.z > 0.0lf) {
    high = min(high, rest / normal.z);
  } else {
    low = max(low, rest / normal.z);
  }
}

// Squared distance of p from the triangle, and the side of its closest point, by the Voronoi
// regions of the corners, edges and interior. `at` is the address of the pseudonormals.
double squaredDistance(dvec3 p, dvec3 a, dvec3 b, dvec3 c, int at, out double side) {
  dvec3 ab = b - a, ac = c - a, ap = p - a, bp = p - b, cp = p - c;
  double d1 = dot(ab, ap), d2 = dot(ac, ap), d3 = dot(ab, bp), d4 = dot(ac, bp);
  double d5 = dot(ab, cp), d6 = dot(ac, cp);
  double va = d3 * d6 - d5 * d4, vb = d5 * d2 - d1 * d6, vc = d1 * d4 - d3 * d2;
  double e4 = d4 - d3, e5 = d5 - d6;
  dvec3 foot;
  int part;
  if (d1 <= 0.0lf && d2 <= 0.0lf) {
    foot = a; part = 0;
  } else if (d3 >= 0.0lf && d4 <= d3) {
    foot = b; part = 1;
  } else if (vc <= 0.0lf && d1 >= 0.0lf && d3 <= 0.0lf && d1 > d3) {
    foot = a + ab * (d1 / (d1 - d3)); part = 3;
  } else if (d6 >= 0.0lf && d5 <= d6) {
    foot = c; part = 2;
  } else if (vb <= 0.0lf && d2 >= 0.0lf && d6 <= 0.0lf && d2 > d6) {
    foot = a + ac * (d2 / (d2 - d6)); part = 5;
  } else if (va <= 0.0lf && e4 >= 0.0lf && e5 >= 0.0lf && e4 + e5 > 0.0lf) {
    foot = b + (c - b) * (e4 / (e4 + e5)); part = 4;
  } else {
    double sum = va + vb + vc;
    foot = a + ab * (vb / sum) + ac * (vc / sum); part = 6;
  }
  dvec3 step = p - foot;
  side = dot(step, vectorAt(at + 3 * part));
  return dot(step, step);
}

void measureHalf(int at, dvec3 a, dvec3 b, dvec3 c, double facing) {
  dvec3 normal = vectorAt(at + 9);
  double level = dot(normal, a), margin = numbers[at + 33];
  int slopes = facing > 0.0lf ? at + 21 : at + 27;
  low = -3.5lf;
  high = 3.5lf;
  cut(normal * -facing, margin - facing * level);
  cut(normal * facing, reach + margin + facing * level);
  cut(vectorAt(at + 12) - normal * (facing * numbers[slopes]),
      dot(vectorAt(at + 12), a) - facing * numbers[slopes] * level + numbers[slopes + 3] + margin);
  cut(vectorAt(at + 15) - normal * (facing * numbers[slopes + 1]),
      dot(vectorAt(at + 15), b) - facing * numbers[slopes + 1] * level + numbers[slopes + 4] + margin);
  cut(vectorAt(at + 18) - normal * (facing * numbers[slopes + 2]),
      dot(vectorAt(at + 18), c) - facing * numbers[slopes + 2] * level + numbers[slopes + 5] + margin);
  if (!(low <= high)) return;
  for (int k = 0; k < 8; ++k) {
    double z = double(k) - 3.5lf;
    if (z < low || z > high) continue;
    double side;
    double squared = squaredDistance(dvec3(rowX, rowY, z), a, b, c, at + 34, side);
    if (squared < bestSquared[k]) {
      bestSquared[k] = squared;
      bestSide[k] = side;
    }
  }
}

void main() {
  int block = firstBlock + int(gl_WorkGroupID.x);
  int row = int(gl_LocalInvocationID.x);
  rowX = double(row >> 3) - 3.5lf;
  rowY = double(row & 7) - 3.5lf;
  dvec3 centre = dvec3(blocks[5 * block], blocks[5 * block + 1], blocks[5 * block + 2]) + 3.5lf;
  for (int k = 0; k < 8; ++k) {
    bestSquared[k] = reach * reach;
    bestSide[k] = 1.0lf;
  }
  for (int i = blocks[5 * block + 3]; i < blocks[5 * block + 4]; ++i) {
    int at = kTriangleNumbers * lists[i];
    dvec3 a = vectorAt(at) - centre, b = vectorAt(at + 3) - centre, c = vectorAt(at + 6) - centre;
    measureHalf(at, a, b, c, 1.0lf);
    measureHalf(at, a, b, c, -1.0lf);
  }
  for (int k = 0; k < 8; ++k) {
    float d = float(sqrt(bestSquared[k]));
    distances[512 * block + 8 * row + k] = bestSide[k] < 0.0lf ? -d : d;
  }
}
)GLSL";

/// Data of the shader's storage blocks.
struct PrismTables {
  std::vector<double> triangles;
  std::vector<std::int32_t> blocks, lists;
};

void appendTo(std::vector<double>& numbers, const V3d& v) {
  numbers.insert(numbers.end(), {v.x, v.y, v.z});
}

std::vector<double> triangleNumbers(const LocalMesh& mesh, const PrismCovering& prisms,
                                    const levelset::convert::Pseudonormals& normals) {
  std::vector<double> numbers;
  numbers.reserve(kTriangleNumbers * mesh.triangles.size());
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    const PrismCovering::Prism& prism = prisms.prism(t);
    for (std::size_t k = 0; k < 3; ++k) appendTo(numbers, mesh.corner(t, k));
    appendTo(numbers, V3d(prism.normal));
    for (const Imath::V3f& outward : prism.outward) appendTo(numbers, V3d(outward));
    for (const PrismCovering::Half* half : {&prism.front, &prism.back}) {
      for (const float slope : half->slope) numbers.push_back(static_cast<double>(slope));
      for (const float shift : half->shift) numbers.push_back(static_cast<double>(shift));
    }
    numbers.push_back(static_cast<double>(prism.margin));
    for (int part = 0; part < 7; ++part) appendTo(numbers, normals.at(t, part).normal);
  }
  return numbers;
}

/// Lists the triangles of each block, ordered by the origins of the blocks.
PrismTables tablesOf(const LocalMesh& mesh, const PrismCovering& prisms,
                     std::vector<V3i>& origins) {
  struct Block {
    V3i origin;
    std::vector<std::uint32_t> triangles;
  };
  std::vector<Block> found;
  std::mutex mutex;
  levelset::convert::forEachBlock(
      mesh, prisms.reach(),
      [&](const V3i& origin, std::span<const std::uint32_t> candidates) {
        Block block{origin, {candidates.begin(), candidates.end()}};
        const std::lock_guard lock(mutex);
        found.push_back(std::move(block));
      },
      {}, {}, levelset::convert::prismTest(mesh, prisms));
  std::sort(found.begin(), found.end(), [](const Block& a, const Block& b) {
    return std::tie(a.origin.x, a.origin.y, a.origin.z) <
           std::tie(b.origin.x, b.origin.y, b.origin.z);
  });
  PrismTables tables;
  for (const Block& block : found) {
    origins.push_back(block.origin);
    const auto first = static_cast<std::int32_t>(tables.lists.size());
    tables.lists.insert(tables.lists.end(), block.triangles.begin(), block.triangles.end());
    tables.blocks.insert(tables.blocks.end(),
                         {block.origin.x, block.origin.y, block.origin.z, first,
                          static_cast<std::int32_t>(tables.lists.size())});
  }
  return tables;
}

/// Buffers and the program of one call, freed at its end. Lives in a job of GlContext::run().
class PrismRun {
 public:
  explicit PrismRun(const GlContext& context) : context_(context) {}
  ~PrismRun() {
    const GlFunctions& gl = context_.gl();
    for (const GLuint buffer : buffers_)
      if (buffer != 0) gl.DeleteBuffers(1, &buffer);
    if (program_ != 0) gl.DeleteProgram(program_);
    fetched_.release(context_);
  }
  PrismRun(const PrismRun&) = delete;
  PrismRun& operator=(const PrismRun&) = delete;

  void run(const PrismTables& tables, double reach, std::vector<float>& distances) {
    const GlFunctions& gl = context_.gl();
    program_ = compileCompute(
        context_,
        fmt::format("#version 450 core\nconst int kTriangleNumbers = {};\n", kTriangleNumbers) +
            kPrismShader);
    const std::size_t bytes = distances.size() * sizeof(float);
    fill(0, tables.triangles.data(), tables.triangles.size() * sizeof(double));
    fill(1, tables.blocks.data(), tables.blocks.size() * sizeof(std::int32_t));
    fill(2, tables.lists.data(), tables.lists.size() * sizeof(std::int32_t));
    fill(3, &reach, sizeof reach);
    fill(4, nullptr, bytes);
    fetched_.reserve(context_, bytes);
    gl.UseProgram(program_);
    const GLint firstBlock = gl.GetUniformLocation(program_, "firstBlock");
    const std::size_t count = distances.size() / BlockDistances::kPoints;
    for (std::size_t first = 0; first < count; first += kBlocksPerRun) {
      gl.Uniform1i(firstBlock, static_cast<GLint>(first));
      gl.DispatchCompute(static_cast<GLuint>(std::min(kBlocksPerRun, count - first)), 1, 1);
      context_.check("computing distances");
    }
    gl.MemoryBarrier(GL_BUFFER_UPDATE_BARRIER_BIT);
    gl.CopyNamedBufferSubData(buffers_[4], fetched_.name(), 0, 0, static_cast<GLsizeiptr>(bytes));
    gl.Finish();
    context_.check("computing distances");
    std::memcpy(distances.data(), fetched_.mapped(), bytes);
  }

 private:
  void fill(std::size_t binding, const void* data, std::size_t bytes) {
    const GlFunctions& gl = context_.gl();
    GLint64 most = 0;
    gl.GetInteger64v(GL_MAX_SHADER_STORAGE_BLOCK_SIZE, &most);
    if (bytes > static_cast<std::size_t>(most))
      throw levelset::ResourceLimit(
          fmt::format("a table of {} MB does not fit into a storage block of {} MB, the limit of "
                      "{}; use larger voxels, or convert the mesh on the processor",
                      bytes >> 20, most >> 20, context_.description()));
    gl.CreateBuffers(1, &buffers_[binding]);
    gl.NamedBufferData(buffers_[binding], static_cast<GLsizeiptr>(bytes), data, GL_STATIC_DRAW);
    gl.BindBufferBase(GL_SHADER_STORAGE_BUFFER, static_cast<GLuint>(binding), buffers_[binding]);
    context_.check("uploading prisms");
  }

  const GlContext& context_;
  std::array<GLuint, 5> buffers_{};
  GLuint program_ = 0;
  GrowingBuffer fetched_{GrowingBuffer::Use::Fetch};
};

/// Checks that the shader's indices of 32 bits suffice.
void requireSmall(const PrismTables& tables) {
  constexpr std::size_t kMost = std::size_t{1} << 31;
  if (std::max({tables.triangles.size(), tables.lists.size(), tables.blocks.size(),
                tables.blocks.size() / 5 * BlockDistances::kPoints}) < kMost)
    return;
  throw levelset::ResourceLimit(
      "the mesh or its band has more than 2^31 numbers; use larger voxels, or convert the mesh on "
      "the processor");
}

void requireClosed(const levelset::convert::MeshTopology& topology) {
  if (topology.isClosed() && topology.boundary.empty()) return;
  throw levelset::InvalidInput(fmt::format(
      "the mesh is not a closed, consistently oriented surface: {} edges have one face, {} have "
      "three or more, and {} have faces of opposite orientations; close it, or convert it on the "
      "processor",
      topology.boundaryEdges, topology.nonManifoldEdges, topology.boundary.size()));
}

}  // namespace

BlockDistances prismDistances(const GlContext& context, const levelset::TriMesh& mesh,
                              double voxelSize, double halfWidth) {
  using namespace levelset::convert;
  checkMeshInput(mesh, voxelSize,
                 {.halfWidth = halfWidth, .method = levelset::DistanceMethod::Prisms});
  const MeshTopology topology = findTopology(mesh);
  requireClosed(topology);
  const V3i origin = localOrigin(mesh, voxelSize);
  const LocalMesh local = toLocal(mesh, topology, voxelSize, origin);
  const PrismCovering prisms(local, halfWidth);
  BlockDistances result;
  PrismTables tables = tablesOf(local, prisms, result.origins);
  tables.triangles = triangleNumbers(local, prisms, Pseudonormals(local));
  requireSmall(tables);
  result.distances.resize(BlockDistances::kPoints * result.origins.size());
  context.run([&] { PrismRun(context).run(tables, halfWidth, result.distances); });
  for (V3i& block : result.origins) block += origin;
  return result;
}

}  // namespace render
