#include "levelset/molecules/solids/rod_union.h"

#include <fmt/core.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <numbers>

#include "levelset/error.h"
#include "levelset/geometry/perpendicular.h"
#include "levelset/geometry/search/point_search.h"
#include "levelset/memory/memory_limit.h"
#include "levelset/molecules/solids/meeting_curve.h"
#include "levelset/progress_gate.h"

namespace levelset {

/// A ball or rod in a search tree.
struct RodItem {
  using Number = double;
  static constexpr bool kHasExtent = true;
  ItemBox<double> around;
  std::uint32_t index;

  [[nodiscard]] ItemBox<double> box() const { return around; }
  [[nodiscard]] double centre(int axis) const { return around.centre(axis); }
  [[nodiscard]] double squaredDistance(const Imath::V3d& from) const {
    return around.squaredDistance(from);
  }
  [[nodiscard]] bool isSameAs(const RodItem& other) const {
    return around.low == other.around.low && around.high == other.around.high;
  }
};

/// A sample of the exposed part of a curve. The closest point near it is between `low` and `high`.
struct CurveSample {
  Imath::V3d point;
  std::uint32_t curve = 0;
  double number = 0, low = 0, high = 0;
};

namespace {

using Imath::V3d;

constexpr double kParallelSticks = 1e-2;  // square of the sine of the angle between two rods
constexpr double kSampleSpacing = 0.2;    // of the radius of the curve
constexpr double kCovered = 1e-9;         // a point this deep in another shape is covered

/// Returns true for two nearly parallel rods whose surfaces meet along their sides. Their curve is
/// too long and thin for samples.
bool lieSideBySide(const RodShape& a, const RodShape& b) {
  if (a.isBall() || b.isBall()) return false;
  const V3d w = (a.to - a.from).normalized(), along = (b.to - b.from).normalized();
  if (w.cross(along).length2() >= kParallelSticks) return false;
  const double from = (b.from - a.from).dot(w), to = (b.to - a.from).dot(w);
  const double low = std::max(0.0, std::min(from, to)),
               high = std::min((a.to - a.from).length(), std::max(from, to));
  if (high - low <= std::max(a.radius, b.radius)) return false;
  // Points of both axes in a plane across `w`. Their difference is linear in the place of the
  // plane.
  const auto apart = [&](double s) {
    return b.from + (b.to - b.from) * ((s - from) / (to - from)) - (a.from + w * s);
  };
  const V3d first = apart(low), change = apart(high) - first;
  const double squared = change.length2();
  const double t = squared > 0 ? std::clamp(-first.dot(change) / squared, 0.0, 1.0) : 0;
  const double least = (first + change * t).length(),
               most = std::max(first.length(), (first + change).length());
  // Where axes coincide, so do the surfaces, or one lies in the other.
  return least < a.radius + b.radius && most > std::abs(a.radius - b.radius) + kCovered;
}

}  // namespace

struct RodUnion::Data {
  V3d origin{0};
  std::vector<RodShape> shapes;  ///< relative to the origin
  Imath::Box3d bounds;           ///< relative to the origin
  OverlapTree<RodItem> tree;
  std::vector<MeetingCurve> curves;
  std::vector<CurveSample> samples;
  PointSearch points;
  double spacing = 0;  ///< largest distance of samples on a curve

  /// Calls back with the shapes whose boxes are at most as far as `*squared`.
  template <class Look>
  void near(const V3d& point, const double& squared, const Look& look) const {
    tree.visit(point, squared, [&](const RodItem& item) { look(item.index); });
  }
  [[nodiscard]] bool isCoveredBut(const V3d& point, std::uint32_t a, std::uint32_t b) const {
    bool isIn = false;
    const double none = 0;
    near(point, none, [&](std::uint32_t n) {
      isIn = isIn || (n != a && n != b && shapes[n].distance(point) < -kCovered);
    });
    return isIn;
  }
  /// Position on a curve; `isOpen` tells whether it is part of the boundary.
  [[nodiscard]] V3d at(const MeetingCurve& curve, double number, bool& isOpen) const {
    const V3d point = curve.at(number, shapes[curve.first], shapes[curve.second], isOpen);
    isOpen = isOpen && !isCoveredBut(point, curve.first, curve.second);
    return point;
  }
  void addSamples(std::uint32_t curve, std::vector<CurveSample>& out) const;
  [[nodiscard]] double closestOnCurves(const V3d& point) const;
  [[nodiscard]] double refine(const V3d& point, const CurveSample& sample) const;
};

void RodUnion::Data::addSamples(std::uint32_t curve, std::vector<CurveSample>& out) const {
  const MeetingCurve& of = curves[curve];
  constexpr double kHalfPi = std::numbers::pi / 2;
  // The number of intervals follows from the length of a coarse polygon.
  double length = 0;
  bool isOpen = false;
  constexpr int kCoarse = 12;
  V3d last = of.at(-kHalfPi, shapes[of.first], shapes[of.second], isOpen);
  for (int n = 1; n <= kCoarse; ++n) {
    const V3d next = of.at(-kHalfPi + std::numbers::pi * n / kCoarse, shapes[of.first],
                           shapes[of.second], isOpen);
    length += std::min((next - last).length(), 4 * of.radius);
    last = next;
  }
  const auto count = static_cast<int>(
      std::clamp(std::ceil(1.6 * length / (kSampleSpacing * of.radius)), 8.0, 1000.0));
  const auto numberAt = [&](int n) { return -kHalfPi + std::numbers::pi * n / count; };
  bool wasOpen = false;
  double lastNumber = -kHalfPi;
  std::size_t begin = out.size();
  const auto close = [&](std::size_t end) {
    for (std::size_t n = begin; n < end; ++n) {
      out[n].low = out[n == begin ? n : n - 1].number;
      out[n].high = out[n + 1 == end ? n : n + 1].number;
    }
    begin = end;
  };
  // End of an exposed part between two numbers.
  const auto endBetween = [&](double open, double covered) {
    for (int n = 0; n < 50; ++n) {
      const double middle = (open + covered) / 2;
      bool isMiddleOpen = false;
      (void)at(of, middle, isMiddleOpen);
      (isMiddleOpen ? open : covered) = middle;
    }
    return open;
  };
  const auto push = [&](double number) {
    bool isAny = false;
    out.push_back({of.at(number, shapes[of.first], shapes[of.second], isAny), curve, number});
  };
  for (int n = 0; n <= count; ++n) {
    const double number = numberAt(n);
    (void)at(of, number, isOpen);
    if (n > 0 && isOpen && !wasOpen) push(endBetween(number, lastNumber));
    if (n > 0 && !isOpen && wasOpen) {
      push(endBetween(lastNumber, number));
      close(out.size());
    }
    if (isOpen) push(number);
    wasOpen = isOpen;
    lastNumber = number;
  }
  close(out.size());
}

double RodUnion::Data::refine(const V3d& point, const CurveSample& sample) const {
  // Golden section. The error of the distance is the square of that of the number.
  constexpr double kGolden = 0.6180339887498949;
  const MeetingCurve& curve = curves[sample.curve];
  const auto squared = [&](double number) {
    bool isOnBoth = false;
    return (curve.at(number, shapes[curve.first], shapes[curve.second], isOnBoth) - point)
        .length2();
  };
  double low = sample.low, high = sample.high, best = (sample.point - point).length2();
  double a = high - kGolden * (high - low), b = low + kGolden * (high - low);
  double atA = squared(a), atB = squared(b);
  while (high - low > 1e-8) {
    if (atA < atB) {
      high = b;
      b = a;
      atB = atA;
      a = high - kGolden * (high - low);
      atA = squared(a);
    } else {
      low = a;
      a = b;
      atA = atB;
      b = low + kGolden * (high - low);
      atB = squared(b);
    }
  }
  best = std::min({best, atA, atB});
  return std::sqrt(best);
}

double RodUnion::Data::closestOnCurves(const V3d& point) const {
  const FoundItem nearest = points.closest(point, std::numeric_limits<double>::infinity());
  if (!nearest.isValid()) return std::numeric_limits<double>::infinity();
  const double reach = std::sqrt(nearest.squared) + spacing;
  thread_local std::vector<FoundItem> found;
  points.within(point, reach * reach, found);
  double best = std::sqrt(nearest.squared);
  for (const FoundItem& item : found) {
    const CurveSample& sample = samples[item.index];
    // Only samples that are closer than both of their neighbours.
    const auto isFarther = [&](std::size_t other, double number) {
      return other < samples.size() && samples[other].curve == sample.curve &&
             samples[other].number == number &&
             (samples[other].point - point).length2() < item.squared;
    };
    if ((sample.low < sample.number && isFarther(item.index - 1, sample.low)) ||
        (sample.high > sample.number && isFarther(item.index + 1, sample.high)))
      continue;
    best = std::min(best, refine(point, sample));
  }
  return best;
}

RodUnion::RodUnion(const std::vector<Ball>& balls, const std::vector<Rod>& rods,
                   std::size_t maxBytes, const Progress& progress) {
  if (balls.empty()) throw InvalidInput("there is no ball; give at least one");
  auto data = std::make_shared<Data>();
  Imath::Box3d centres;
  for (const Ball& ball : balls) {
    const V3d& c = ball.centre;
    if (!std::isfinite(c.x) || !std::isfinite(c.y) || !std::isfinite(c.z) || !(ball.radius > 0) ||
        !std::isfinite(ball.radius))
      throw InvalidInput("a ball has no finite centre or no positive radius");
    centres.extendBy(c);
  }
  maxBytes = memoryLimit(maxBytes);
  data->origin = centres.center();
  for (const Ball& ball : balls)
    data->shapes.push_back({ball.centre - data->origin, ball.centre - data->origin, ball.radius});
  for (const Rod& rod : rods) {
    if (rod.first >= balls.size() || rod.second >= balls.size() || !(rod.radius > 0) ||
        rod.radius > std::min(balls[rod.first].radius, balls[rod.second].radius) ||
        balls[rod.first].centre == balls[rod.second].centre)
      throw InvalidInput("a rod is thicker than the balls at its ends, or has no length");
    data->shapes.push_back(
        {data->shapes[rod.first].from, data->shapes[rod.second].from, rod.radius});
  }
  std::vector<RodItem> items;
  items.reserve(data->shapes.size());
  for (const RodShape& shape : data->shapes) {
    Imath::Box3d box(shape.from);
    box.extendBy(shape.to);
    const ItemBox<double> around{box.min - V3d(shape.radius), box.max + V3d(shape.radius)};
    data->bounds.extendBy(around.low);
    data->bounds.extendBy(around.high);
    items.push_back({around, static_cast<std::uint32_t>(items.size())});
  }
  data->tree = OverlapTree<RodItem>(items);

  // Curves of each pair whose boxes meet, by the lower index.
  const std::size_t count = data->shapes.size();
  std::vector<std::vector<MeetingCurve>> curves(count);
  std::atomic<std::size_t> bytes = 0;
  ProgressGate meeting(subProgress(progress, 0, 0.3), count);
  tbb::parallel_for(std::size_t{0}, count, [&](std::size_t n) {
    const RodShape& shape = data->shapes[n];
    const V3d middle = (shape.from + shape.to) / 2;
    const double reach = (shape.to - shape.from).length() / 2 + shape.radius;
    const double squared = reach * reach;
    std::vector<std::uint32_t> others;
    data->near(middle, squared, [&](std::uint32_t other) {
      if (other > n) others.push_back(other);
    });
    std::sort(others.begin(), others.end());
    for (const std::uint32_t other : others) {
      if (lieSideBySide(shape, data->shapes[other]))
        throw InvalidInput(
            "two sticks lie side by side and overlap; give a smaller --stick-radius");
      addMeetingCurves(data->shapes, static_cast<std::uint32_t>(n), other, curves[n]);
    }
    bytes += 2 * curves[n].size() * sizeof(MeetingCurve);  // and a copy
    requireMemory(static_cast<double>(bytes), maxBytes);
    meeting.advance(1);
  });
  for (auto& list : curves) {
    data->curves.insert(data->curves.end(), list.begin(), list.end());
    list = {};
  }
  std::vector<std::vector<CurveSample>> samples(data->curves.size());
  ProgressGate gate(subProgress(progress, 0.3, 1), data->curves.size());
  tbb::parallel_for(std::size_t{0}, data->curves.size(), [&](std::size_t n) {
    data->addSamples(static_cast<std::uint32_t>(n), samples[n]);
    bytes += (2 * sizeof(CurveSample) + sizeof(PointItem)) * samples[n].size();
    requireMemory(static_cast<double>(bytes), maxBytes);
    gate.advance(1);
  });
  std::vector<V3d> positions;
  for (auto& list : samples) {
    for (std::size_t n = 1; n < list.size(); ++n)
      if (list[n].low == list[n - 1].number && list[n].low < list[n].number)
        data->spacing = std::max(data->spacing, (list[n].point - list[n - 1].point).length());
    data->samples.insert(data->samples.end(), list.begin(), list.end());
    list = {};
  }
  positions.reserve(data->samples.size());
  for (const CurveSample& sample : data->samples) positions.push_back(sample.point);
  if (!positions.empty()) data->points = makePointSearch(positions);
  data_ = std::move(data);
}

double RodUnion::distance(const V3d& world, double depth) const {
  const Data& data = *data_;
  const V3d point = world - data.origin;
  double least = std::numeric_limits<double>::infinity(), squared = least;
  std::uint32_t closest = 0;
  data.near(point, squared, [&](std::uint32_t n) {
    const double distance = data.shapes[n].distance(point);
    if (distance < least || (distance == least && n < closest)) {
      least = distance;
      closest = n;
      squared = std::max(0.0, least) * std::max(0.0, least);
    }
  });
  if (least >= 0 || -least > depth) return least;
  const RodShape& shape = data.shapes[closest];
  const V3d axis = shape.onAxis(point);
  V3d away = point - axis;
  if (!(away.length() > 0))
    away = shape.isBall() ? V3d(0, 0, 1) : anyPerpendicular((shape.to - shape.from).normalized());
  const V3d foot = axis + away.normalized() * shape.radius;
  if (!data.isCoveredBut(foot, closest, closest)) return least;
  return -std::max(-least, data.closestOnCurves(point));
}

Imath::Box3d RodUnion::bounds() const {
  return {data_->bounds.min + data_->origin, data_->bounds.max + data_->origin};
}

std::size_t RodUnion::bytes() const {
  return data_->samples.capacity() * (sizeof(CurveSample) + sizeof(PointItem)) +
         data_->curves.capacity() * sizeof(MeetingCurve) +
         data_->shapes.capacity() * (sizeof(RodShape) + sizeof(RodItem));
}

}  // namespace levelset
