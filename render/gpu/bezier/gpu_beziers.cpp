#include "render/gpu/bezier/gpu_beziers.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>
#include <utility>

#include "render/bezier/shared_tree_data.h"
#include "render/bezier/tree_root.h"
#include "render/gpu/bezier/bezier_device.h"

namespace render {
namespace {

using Imath::V2d;

// Invocations of a dispatch, few enough to finish within the time limits of drivers.
constexpr std::size_t kMostInvocations = 1u << 20;
// Iterations of loops in one call of the shader. Mesa's llvmpipe ends loops without notice after
// 65535 iterations of all loops of up to 16 invocations.
constexpr std::size_t kMostIterations = 30'000;
constexpr std::size_t kRayGroup = 64;  // rays whose box is compared with that of a shared node
constexpr double kStopped = -1e301;    // nearest depth of a ray that needs no further roots

/// Counters of bezier_tree.glsl.
struct Counter {
  enum Value : std::size_t {
    PairsOfBox,
    NodesOfBox,
    PairsOfFrame,
    NodesOfFrame,
    OpenPairs,
    RootsFound,
    KeptPairs,
    SplitNodes,
    Overruns,
    Unfinished
  };
};
using Counters = std::array<std::uint32_t, kListCounters>;

/// Positions in the head of a node, see bezier.glsl.
constexpr std::size_t kHeadLeast = 4, kHeadCentre = 5, kHeadInverse = 7, kHeadLow = 16,
                      kHeadHigh = 19, kHeadMiddle = 22, kHeadWeight = 25, kHeadAcross = 26,
                      kHeadScale = 35, kHeadFlags = 40, kHeadLevel = 41, kHeadCell = 42,
                      kHeadPatch = 45, kHeadProven = 47;
constexpr int kHeadKept = 1, kHeadCrosses = 2, kHeadFrame = 4;

/// True if products of components are normal numbers at all levels. Drivers may replace numbers
/// below the least normal one by 0. Six factors of 1e-30 times 2^-24 are 5e-224.
bool isInRange(const SharedTree::Data& tree) {
  constexpr double kLeast = 1e-30, kMost = 1e40;
  return std::all_of(tree.nodes.begin(), tree.nodes.end(), [&](const TreeNode& node) {
    const ComponentScale& scale = tree.context.scaleOf(node);
    return std::all_of(scale.most.begin(), scale.most.begin() + 4,
                       [](double most) { return most == 0 || (most >= kLeast && most <= kMost); });
  });
}

}  // namespace

/// The roots of the rays of one call.
template <int N>
class GpuBeziers::Device::Run {
 public:
  Run(Device& device, const SharedTree::Data& tree, RayGroup& group, std::vector<char>& isGivenUp)
      : device_(device), tree_(tree), group_(group), isGivenUp_(isGivenUp) {}

  void run() {
    const GlFunctions& gl = device_.gl;
    GLint64 most = 0;
    gl.GetInteger64v(GL_MAX_SHADER_STORAGE_BLOCK_SIZE, &most);
    device_.blockBytes = std::min(static_cast<std::size_t>(most), std::size_t{1} << 30);
    const std::size_t slice = device_.slice(N);
    if (device_.free() < device_.mostBytes / 2) device_.releaseFrom(0);
    fitBuffer(device_.context, device_.fetched, device_.fetchBytes());
    fitBuffer(device_.context, device_.roots, slice * 8 * bezierRootNumbers(N));
    fitBuffer(device_.context, device_.states, slice * 8 * kBezierStates);
    const std::array<double, 2> ends{std::max(tree_.context.view.near, -1e300),
                                     std::min(tree_.context.view.far, 1e300)};
    fitBuffer(device_.context, device_.view, sizeof ends);
    device_.upload<double>(device_.view, ends);
    std::vector<std::array<int, 3>> degrees;
    for (const TreeNode& node : tree_.nodes)
      if (std::find(degrees.begin(), degrees.end(), node.degree) == degrees.end())
        degrees.push_back(node.degree);
    const std::size_t batch = std::clamp<std::size_t>(device_.mostBytes / 2048, 64, 1u << 16);
    for (std::size_t first = 0; first < group_.screens.size(); first += batch) {
      first_ = first;
      count_ = std::min(batch, group_.screens.size() - first);
      startRays();
      for (const std::array<int, 3>& degree : degrees) castDegree(degree);
    }
  }

 private:
  struct Box {
    double left = 1e300, right = -1e300, top = 1e300, bottom = -1e300;
  };

  void startRays() {
    std::vector<double> numbers;
    numbers.reserve(3 * count_);
    boxes_.assign((count_ + kRayGroup - 1) / kRayGroup, {});
    for (std::size_t n = 0; n < count_; ++n) {
      const V2d& screen = group_.screens[first_ + n];
      numbers.insert(numbers.end(), {screen.x, screen.y});
      Box& box = boxes_[n / kRayGroup];
      box.left = std::min(box.left, screen.x);
      box.right = std::max(box.right, screen.x);
      box.top = std::min(box.top, screen.y);
      box.bottom = std::max(box.bottom, screen.y);
    }
    nearest_.assign(count_, 1e300);
    fitBuffer(device_.context, device_.rays, 24 * count_);
    device_.upload<double>(device_.rays, numbers);
    uploadNearest();
  }

  void uploadNearest() { device_.upload<double>(device_.rays, nearest_, 2 * count_); }

  void giveUp(std::uint32_t ray) {
    isGivenUp_[first_ + ray] = 1;
    nearest_[ray] = kStopped;
  }

  /// Casts the rays through the shared nodes of one degree, in parts that fit into the memory.
  void castDegree(const std::array<int, 3>& degree) {
    std::size_t points = 1;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      order_[axis] = static_cast<std::size_t>(degree[axis]) + 1;
      points *= order_[axis];
    }
    if (device_.pointBytes != 8 * N * points) device_.releaseLevels();
    device_.pointBytes = 8 * N * points;
    variant_ = {.components = N,
                .weight = tree_.context.view.isPerspective ? kDepth + 0 : N - 1,
                .isPerspective = tree_.context.view.isPerspective,
                .mostOrder = *std::max_element(order_.begin(), order_.end()) <= 6 ? 6 : 21};
    std::vector<const TreeNode*> part;
    std::vector<std::uint32_t> pairs, more;
    const auto flush = [&] {
      if (!part.empty()) castNodes(part, pairs);
      part.clear();
      pairs.clear();
    };
    for (const TreeNode& node : tree_.nodes) {
      if (node.degree != degree) continue;
      more.clear();
      addPairs(node, more);
      if (more.empty()) continue;
      const std::size_t mostPairs = device_.mostPairs(0);
      if (part.size() + 1 > device_.mostNodes(0) || (pairs.size() + more.size()) / 3 > mostPairs)
        flush();
      if (device_.mostNodes(0) == 0 || more.size() / 3 > mostPairs) {
        for (const std::uint32_t ray : more) giveUp(ray);
        continue;
      }
      for (const std::uint32_t ray : more) {
        const auto origin = static_cast<std::uint32_t>(pairs.size() / 3);
        pairs.insert(pairs.end(), {static_cast<std::uint32_t>(part.size()), ray, origin});
      }
      part.push_back(&node);
    }
    flush();
  }

  /// Rays that may meet a shared node.
  void addPairs(const TreeNode& node, std::vector<std::uint32_t>& found) const {
    for (std::size_t b = 0; b < boxes_.size(); ++b) {
      const Box& box = boxes_[b];
      if (!node.crossesEye && (node.left > box.right || node.right < box.left ||
                               node.top > box.bottom || node.bottom < box.top))
        continue;
      const std::size_t end = std::min(count_, (b + 1) * kRayGroup);
      for (std::size_t n = b * kRayGroup; n < end; ++n) {
        if (node.leastDepth > nearest_[n]) continue;
        const V2d& screen = group_.screens[first_ + n];
        if (node.crossesEye || !(screen.x < node.left || screen.x > node.right ||
                                 screen.y < node.top || screen.y > node.bottom))
          found.push_back(static_cast<std::uint32_t>(n));
      }
    }
  }

  void castNodes(const std::vector<const TreeNode*>& nodes,
                 const std::vector<std::uint32_t>& pairs) {
    BezierLevel& level = device_.level(0);
    device_.fitNodes(level, nodes.size());
    std::vector<double> heads(kBezierHead * nodes.size(), 0.0);
    std::vector<std::int32_t> slots;
    for (std::size_t n = 0; n < nodes.size(); ++n) {
      writeHead(*nodes[n], heads.data() + kBezierHead * n);
      device_.upload<double>(level.points, nodes[n]->points, n * nodes[n]->points.size());
      slots.push_back(static_cast<std::int32_t>(n));
    }
    device_.upload<double>(level.heads, heads);
    device_.upload<std::int32_t>(level.slots, slots);
    device_.upload<std::uint32_t>(level.marks, std::vector<std::uint32_t>(2 * nodes.size(), 0));
    fitBuffer(device_.context, level.rest, pairs.size() * 4);
    device_.upload<std::uint32_t>(level.rest, pairs);
    origins_ = pairs.size() / 3;
    const std::vector<std::uint32_t> visits(origins_ + count_, 0);
    fitBuffer(device_.context, device_.visits, visits.size() * 4);
    device_.upload<std::uint32_t>(device_.visits, visits);
    ++device_.counts.parts;
    visit(0, level, origins_, 1, origins_);
  }

  void writeHead(const TreeNode& node, double* head) const {
    const ComponentScale& scale = tree_.context.scaleOf(node);
    head[0] = node.left;
    head[1] = node.right;
    head[2] = node.top;
    head[3] = node.bottom;
    head[kHeadLeast] = std::max(node.leastDepth, -1e300);
    head[kHeadCentre] = node.centre.x;
    head[kHeadCentre + 1] = node.centre.y;
    for (std::size_t r = 0; r < 3; ++r) {
      for (std::size_t c = 0; c < 3; ++c) {
        head[kHeadInverse + 3 * r + c] = node.inverse[r][c];
        head[kHeadAcross + 3 * r + c] = node.across[r][c];
      }
      head[kHeadLow + r] = node.low[r];
      head[kHeadHigh + r] = node.high[r];
      head[kHeadMiddle + r] = node.middle[r];
      head[kHeadCell + r] = node.cell[r];
      head[kHeadProven + r] = node.isUnique ? 1 : 0;
    }
    head[kHeadWeight] = node.weight;
    std::copy(scale.most.begin(), scale.most.end(), head + kHeadScale);
    head[kHeadFlags] =
        kHeadKept + (node.crossesEye ? kHeadCrosses : 0) + (node.hasFrame ? kHeadFrame : 0);
    head[kHeadLevel] = node.level;
    head[kHeadPatch] = node.patch;
    head[kHeadPatch + 1] = node.attribute;
  }

  void bind(GLuint place, const GrowingBuffer& buffer) {
    device_.gl.BindBufferBase(GL_SHADER_STORAGE_BUFFER, place, buffer.name());
  }

  struct Uniform {
    const char* name;
    std::size_t value;
  };
  void dispatch(BezierKernel kernel, std::size_t count, std::initializer_list<Uniform> uniforms) {
    const GlFunctions& gl = device_.gl;
    const GLuint program = device_.programs.program(kernel, variant_);
    gl.UseProgram(program);
    const auto set = [&](const char* name, std::size_t value) {
      gl.Uniform1i(gl.GetUniformLocation(program, name), static_cast<GLint>(value));
    };
    set("order0", order_[0]);
    set("order1", order_[1]);
    set("order2", order_[2]);
    set("rayCount", count_);
    set("originCount", origins_);
    for (const auto& [name, value] : uniforms) set(name, value);
    for (std::size_t first = 0; first < count; first += kMostInvocations) {
      const std::size_t end = std::min(count, first + kMostInvocations);
      set("first", first);
      set("count", end);
      gl.DispatchCompute(static_cast<GLuint>((end - first + kBezierGroup - 1) / kBezierGroup), 1,
                         1);
      gl.MemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT | GL_BUFFER_UPDATE_BARRIER_BIT);
      if (end < count) gl.Finish();
    }
  }

  Counters countersOf(const BezierLevel& level) {
    Counters counters{};
    device_.download<std::uint32_t>(level.lists, 0, counters);
    return counters;
  }

  void bindNodes(const BezierLevel& level) {
    bind(kPointBlock, level.points);
    bind(kHeadBlock, level.heads);
    bind(kListBlock, level.lists);
  }
  void bindPairs(const GrowingBuffer& in, const GrowingBuffer& out) {
    bind(3, in);
    bind(4, out);
  }

  /// Decides pairs of rays and nodes of a level, and visits those below.
  /// @param from  level with the pairs and the slots of its nodes in this level
  /// @param children  nodes of this level for each slot
  /// @param mostPairs  upper bound of the pairs in this level
  void visit(std::size_t depth, const BezierLevel& from, std::size_t pairs, std::size_t children,
             std::size_t mostPairs) {
    BezierLevel& level = device_.level(depth);
    for (GrowingBuffer& list : device_.pairs)
      fitBuffer(device_.context, list, mostPairs * kPairBytes);
    device_.notePeak();
    device_.upload<std::uint32_t>(level.lists, Counters{});
    bindNodes(level);
    bind(2, level.marks);
    bindPairs(from.rest, device_.pairs[0]);
    bind(5, device_.rays);
    bind(7, from.slots);
    const Uniform nodes{"nodeCount", level.used};
    dispatch(BezierKernel::Box, pairs * children, {nodes, {"childCount", children}});
    Counters counters = countersOf(level);
    if (counters[Counter::PairsOfBox] == 0) return;
    if (depth > 0) dispatch(BezierKernel::Frame, counters[Counter::NodesOfBox], {nodes});
    bindPairs(device_.pairs[0], device_.pairs[1]);
    dispatch(BezierKernel::InFrame, counters[Counter::PairsOfBox], {nodes});
    counters = countersOf(level);
    if (counters[Counter::PairsOfFrame] == 0) return;
    if (depth > 0) dispatch(BezierKernel::Prove, 3 * counters[Counter::NodesOfFrame], {nodes});
    solve(level, counters[Counter::PairsOfFrame]);
    uploadNearest();
    counters = countersOf(level);
    if (counters[Counter::OpenPairs] == 0) return;
    fitBuffer(device_.context, level.rest, counters[Counter::OpenPairs] * kPairBytes);
    device_.notePeak();
    bind(2, level.marks);
    bindPairs(device_.pairs[0], level.rest);
    bind(5, device_.visits);
    dispatch(BezierKernel::Keep, counters[Counter::OpenPairs],
             {nodes, {"mostVisits", kMostVisits}});
    counters = countersOf(level);
    if (counters[Counter::Overruns] > 0) {
      std::vector<std::uint32_t> overruns(count_);
      device_.download<std::uint32_t>(device_.visits, origins_, overruns);
      for (std::uint32_t ray = 0; ray < count_; ++ray)
        if (overruns[ray] != 0) giveUp(ray);
      uploadNearest();
    }
    if (counters[Counter::KeptPairs] > 0) split(depth, level, counters);
  }

  /// Solves pairs. The open ones are in the first list of pairs afterwards.
  void solve(BezierLevel& level, std::size_t pairs) {
    const std::size_t slice = device_.slice(N);
    std::size_t jet = 64 + order_[0] * (1 + order_[1] * (1 + order_[2]));
    for (const std::size_t order : order_) jet += order * order / 2;
    const std::size_t mostJets = std::max<std::size_t>(1, kMostIterations / jet);
    bind(2, device_.roots);
    bindPairs(device_.pairs[1], device_.pairs[0]);
    bind(5, device_.rays);
    bind(7, device_.states);
    device_.counts.solutions += pairs;
    for (std::size_t first = 0; first < pairs; first += slice) {
      for (std::size_t unfinished = 1, round = 0; unfinished > 0; ++round) {
        const std::array<std::uint32_t, 1> none{0};
        device_.upload<std::uint32_t>(level.lists, none, Counter::RootsFound);
        device_.upload<std::uint32_t>(level.lists, none, Counter::Unfinished);
        dispatch(
            BezierKernel::Solve, std::min(slice, pairs - first),
            {{"firstPair", first}, {"mostJets", mostJets}, {"isResumed", round > 0 ? 1u : 0u}});
        const Counters counters = countersOf(level);
        unfinished = counters[Counter::Unfinished];
        takeRoots(counters[Counter::RootsFound]);
      }
    }
  }

  /// Adds roots that the device has found to those of the rays.
  void takeRoots(std::size_t count) {
    constexpr std::size_t kNumbers = bezierRootNumbers(N);
    std::vector<double> numbers(count * kNumbers);
    device_.download<double>(device_.roots, 0, numbers);
    std::vector<std::optional<BezierRoot>> found(count);
    const auto rayOf = [&](std::size_t n) {
      return static_cast<std::uint32_t>(numbers[n * kNumbers]);
    };
    tbb::parallel_for(std::size_t{0}, count, [&](std::size_t n) {
      const double* from = numbers.data() + n * kNumbers;
      const bool isSingular = from[1] != 0;
      NodePlace place;
      place.level = static_cast<int>(from[2]);
      for (std::size_t c = 0; c < 3; ++c) place.cell[c] = static_cast<std::uint32_t>(from[3 + c]);
      place.patch = static_cast<std::uint32_t>(from[6]);
      place.attribute = static_cast<std::uint32_t>(from[7]);
      NodeJet<N> jet;
      for (std::size_t c = 0; c < N; ++c) {
        jet.value[c] = from[14 + c];
        for (std::size_t axis = 0; axis < 3; ++axis)
          jet.slope[axis][c] = from[14 + (axis + 1) * N + c];
      }
      found[n] =
          rootOf<N>(tree_.context, place, group_.screens[first_ + rayOf(n)],
                    {from[8], from[9], from[10]}, jet, {from[11], from[12], from[13]}, isSingular);
    });
    for (std::size_t n = 0; n < count; ++n) {
      if (!found[n]) continue;
      const std::size_t ray = first_ + rayOf(n);
      group_.add(static_cast<std::uint32_t>(ray), *found[n], tree_.context.allRoots);
      if (!tree_.context.allRoots)
        nearest_[ray - first_] = std::min(nearest_[ray - first_], group_.nearest[ray]);
    }
  }

  /// Splits the nodes of a level that have undecided pairs, and visits their children.
  void split(std::size_t depth, BezierLevel& level, const Counters& counters) {
    const std::size_t nodes = level.used, pairs = counters[Counter::KeptPairs];
    std::vector<std::uint32_t> open(counters[Counter::SplitNodes]), marks(2 * nodes);
    device_.download<std::uint32_t>(level.lists, kListCounters + 2 * nodes, open);
    device_.download<std::uint32_t>(level.marks, 0, marks);
    std::sort(open.begin(), open.end());
    bool hasReleased = false;
    for (std::size_t at = 0; at < open.size();) {
      BezierLevel& below = device_.level(depth + 1);
      const std::size_t mostNodes = device_.mostNodes(depth + 1),
                        mostPairs = device_.mostPairs(depth + 1);
      std::vector<std::int32_t> slots(nodes, -1), parents;
      std::size_t pairsBelow = 0;
      for (; at < open.size(); ++at) {
        const std::size_t more = 8 * std::size_t{marks[2 * open[at] + 1]};
        if (8 * parents.size() + 8 > mostNodes || pairsBelow + more > mostPairs) break;
        slots[open[at]] = static_cast<std::int32_t>(8 * parents.size());
        parents.push_back(static_cast<std::int32_t>(open[at]));
        pairsBelow += more;
      }
      if (parents.empty() && !hasReleased) {  // other parts may have left large lists
        device_.releaseFrom(depth + 1);
        hasReleased = true;
        continue;
      }
      hasReleased = false;
      if (parents.empty()) {  // the processor answers for its rays
        giveUpNode(level, open[at], pairs);
        ++at;
        continue;
      }
      device_.counts.splits += parents.size();
      if (at < open.size()) ++device_.counts.parts;
      device_.upload<std::int32_t>(level.slots, slots);
      device_.upload<std::int32_t>(level.parents, parents);
      device_.fitNodes(below, 8 * parents.size());
      makeChildren(level, below, parents.size());
      visit(depth + 1, level, pairs, 8, pairsBelow);
    }
  }

  void makeChildren(const BezierLevel& level, const BezierLevel& below, std::size_t parents) {
    const std::size_t numbers = device_.pointBytes / 8;
    bindNodes(below);
    bind(3, level.points);
    bind(4, level.parents);
    for (std::size_t axis = 0; axis < 3; ++axis)
      dispatch(BezierKernel::Halve, (parents << axis) * (numbers / order_[axis]), {{"axis", axis}});
    bind(2, below.marks);
    bind(3, level.heads);
    bind(5, device_.view);
    dispatch(BezierKernel::Bound, 8 * parents, {});
  }

  void giveUpNode(const BezierLevel& level, std::uint32_t node, std::size_t pairs) {
    std::vector<std::uint32_t> rest(3 * pairs);
    device_.download<std::uint32_t>(level.rest, 0, rest);
    for (std::size_t n = 0; n < rest.size(); n += 3)
      if (rest[n] == node) giveUp(rest[n + 1]);
    uploadNearest();
  }

  Device& device_;
  const SharedTree::Data& tree_;
  RayGroup& group_;
  std::vector<char>& isGivenUp_;
  std::size_t first_ = 0, count_ = 0;  // rays of the batch
  std::size_t origins_ = 0;            // pairs of rays and shared nodes
  std::vector<double> nearest_;        // depths beyond which nodes need not be visited
  std::vector<Box> boxes_;             // of groups of rays
  std::array<std::size_t, 3> order_{};
  BezierVariant variant_;
};

GpuBeziers::GpuBeziers(const GlContext& context, std::size_t mostBytes)
    : device_(std::make_unique<Device>(context, mostBytes)) {}
GpuBeziers::~GpuBeziers() = default;

void GpuBeziers::release() {
  device_->release();
}

const GpuBezierCounts& GpuBeziers::counts() const {
  return device_->counts;
}

SharedTree::Roots GpuBeziers::rootsOn(const SharedTree& tree, const std::vector<V2d>& screens,
                                      TreeCounts* counts) {
  const SharedTree::Data& data = tree.data();
  if (!isInRange(data)) {
    device_->context.run([&] { device_->counts.onProcessor += screens.size(); });
    return tree.rootsOn(screens, counts);
  }
  RayGroup group;
  group.start(screens, data.context.allRoots);
  std::vector<char> isGivenUp(screens.size(), 0);
  device_->context.run([&] {
    if (data.isPolynomial)
      Device::Run<4>(*device_, data, group, isGivenUp).run();
    else
      Device::Run<5>(*device_, data, group, isGivenUp).run();
    device_->counts.onProcessor +=
        static_cast<std::size_t>(std::count(isGivenUp.begin(), isGivenUp.end(), 1));
  });
  std::vector<V2d> asked;
  for (std::size_t n = 0; n < screens.size(); ++n)
    if (isGivenUp[n]) asked.push_back(screens[n]);
  const SharedTree::Roots found = data.finished(group);
  if (asked.empty()) return found;
  const SharedTree::Roots others = tree.rootsOn(asked, counts);
  SharedTree::Roots result;
  result.first.push_back(0);
  for (std::size_t n = 0, other = 0; n < screens.size(); ++n) {
    const SharedTree::Roots& from = isGivenUp[n] ? others : found;
    const std::size_t ray = isGivenUp[n] ? other++ : n;
    for (std::size_t r = from.first[ray]; r < from.first[ray + 1]; ++r)
      result.roots.push_back(from.roots[r]);
    result.first.push_back(result.roots.size());
  }
  return result;
}

}  // namespace render
