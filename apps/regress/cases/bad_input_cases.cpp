#include <fmt/core.h>
#include <openvdb/tools/ChangeBackground.h>

#include <cmath>
#include <limits>

#include "apps/regress/recorder.h"
#include "apps/regress/truth/exact_band.h"
#include "levelset/csg/csg.h"
#include "levelset/distance/redistance.h"
#include "levelset/inspect/check.h"
#include "levelset/inspect/measure.h"
#include "levelset/offset/offset.h"
#include "levelset/transform/resample.h"
#include "levelset/transform/transform.h"
#include "levelset/vdb.h"

namespace regress {

using Imath::M44d;
using Imath::V3d;
using levelset::ExitCode;
using levelset::NarrowBand;

namespace {

constexpr double kVoxel = 1.0 / 16;

NarrowBand solid() {
  return exactBand(ball(V3d(0.01, 0.02, 0.03), 1), kVoxel);
}

/// Builds a grid with one bad value, as a program can create it or a damaged file can contain it.
openvdb::FloatGrid::Ptr spoiled(float value) {
  const auto grid = levelset::vdb(solid()).deepCopy();
  grid->tree().setValueOn(grid->cbeginValueOn().getCoord(), value);
  return grid;
}

/// Builds the sphere on a grid whose transform has the given axes, which a band cannot have.
openvdb::FloatGrid::Ptr onAxes(const openvdb::math::Mat4d& matrix) {
  const auto grid = levelset::vdb(solid()).deepCopy();
  grid->setTransform(openvdb::math::Transform::createLinearTransform(matrix));
  return grid;
}

void hugeOffsets(Recorder& out) {
  out.expectRefusal("offset to nothing", ExitCode::Input,
                    [] { (void)levelset::offset(solid(), -1.2); });
  out.expectRefusal("offset by −100 to nothing", ExitCode::Input,
                    [] { (void)levelset::offset(solid(), -100); });
  // A ball of 101 radii needs about 6 × 4π (16 × 101)² voxels, or a gigabyte.
  out.expectRefusal("offset by 100 times the object under 256 MB", ExitCode::Resource, [] {
    (void)levelset::offset(solid(), 100, {.maxMemory = std::size_t{256} << 20});
  });
  if (out.isQuick()) return;
  out.expect(
      "offset by 100 times the object on voxels of half its radius",
      "a ball of 101 radii, volume within 1 %", [] {
        const NarrowBand grown = levelset::offset(levelset::resample(solid(), 0.5), 100);
        const double error = levelset::measure(grown).volume / *ball(V3d(0), 101).volume - 1;
        return std::pair{std::abs(error) <= 0.01, fmt::format("volume {:+.3g} %", 100 * error)};
      });
}

void emptyAndFull(Recorder& out) {
  const auto nothing = [] {
    return levelset::makeBand(levelset::emptyLevelSet(levelset::uniformTransform(kVoxel), 3));
  };
  const auto full = [] {
    const auto grid = levelset::emptyLevelSet(levelset::uniformTransform(kVoxel), 3);
    grid->fill(openvdb::CoordBBox(openvdb::Coord(0), openvdb::Coord(15)), -grid->background());
    grid->tree().voxelizeActiveTiles();
    return levelset::makeBand(grid);
  };
  out.expectRefusal("redistance of an empty band", ExitCode::Input,
                    [&] { (void)levelset::redistance(nothing()); });
  out.expectRefusal("offset of an empty band", ExitCode::Input,
                    [&] { (void)levelset::offset(nothing(), 0.1); });
  out.expectRefusal("union with an empty band", ExitCode::Input,
                    [&] { (void)levelset::unite(solid(), nothing()); });
  out.expect("measure of an empty band", "volume 0, no components", [&] {
    const levelset::Measurement m = levelset::measure(nothing());
    return std::pair{m.volume == 0 && m.components == 0,
                     fmt::format("volume {}, {} components", m.volume, m.components)};
  });
  out.expectRefusal("redistance of a band without a surface", ExitCode::Input, [&] {
    const auto grid = levelset::emptyLevelSet(levelset::uniformTransform(kVoxel), 3);
    grid->tree().setValueOn(openvdb::Coord(0), grid->background());
    (void)levelset::redistance(levelset::makeBand(grid));
  });
  // All values are minus the background, so none gives the distance to a surface.
  out.expectRefusal("redistance of a block of equal values", ExitCode::Input,
                    [&] { (void)levelset::redistance(full()); });
  out.expect("redistance of a single voxel", "a sound band of one small solid", [&] {
    const auto grid = levelset::emptyLevelSet(levelset::uniformTransform(kVoxel), 3);
    for (int axis = 0; axis < 3; ++axis)
      for (const int side : {-1, 1}) {
        openvdb::Coord c(0);
        c[axis] = side;
        grid->tree().setValueOn(c, static_cast<float>(0.6 * kVoxel));
      }
    grid->tree().setValueOn(openvdb::Coord(0), static_cast<float>(-0.4 * kVoxel));
    const NarrowBand made = levelset::redistance(levelset::makeBand(grid));
    const levelset::Measurement m = levelset::measure(made);
    // The volume of an octahedron with tips 0.4 voxel from the centre is 0.085 voxels³. The cube
    // bounded by the planes of its facets has about four times that volume.
    const double volume = m.volume / (kVoxel * kVoxel * kVoxel);
    const bool isSound = m.components == 1 && m.cavities == 0 && m.euler == 2 && volume > 0.02 &&
                         volume < 0.6 && levelset::check(made).passed();
    return std::pair{isSound,
                     fmt::format("{} solid of {:.3g} voxels³, Euler {}{}", m.components, volume,
                                 m.euler, levelset::check(made).passed() ? "" : ", fails check")};
  });
}

void damagedGrids(Recorder& out) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const float inf = std::numeric_limits<float>::infinity();
  out.expectRefusal("NaN inside a band", ExitCode::Input,
                    [&] { (void)levelset::importBand(spoiled(nan)); });
  out.expectRefusal("infinity inside a band", ExitCode::Input,
                    [&] { (void)levelset::importBand(spoiled(inf)); });
  out.expectRefusal("offset by NaN", ExitCode::Usage, [&] {
    (void)levelset::offset(solid(), std::numeric_limits<double>::quiet_NaN());
  });
  out.expect("background of 10 voxels around a band of 3", "a sound band after redistance", [] {
    const auto grid = levelset::vdb(solid()).deepCopy();
    openvdb::tools::changeBackground(grid->tree(), static_cast<float>(10 * kVoxel));
    const NarrowBand made = levelset::redistance(levelset::importBand(grid), {.halfWidth = 3});
    Figures figures;
    addErrors(made, ball(V3d(0.01, 0.02, 0.03), 1), Mesher::Ours, figures);
    const double error = std::max(figures["band_in_linf_vx"], figures["band_out_linf_vx"]);
    const double gaps = figures["missing_band"];
    return std::pair{isAsMeasured(error, 3.03e-4) && gaps == 0 && levelset::check(made).passed(),
                     fmt::format("band L∞ {:.3g} voxels, gaps {:.3g}", error, gaps)};
  });
}

openvdb::math::Mat4d axes(double x, double y, double z, double shear) {
  return openvdb::math::Mat4d(x, 0.0, 0.0, 0.0, shear, y, 0.0, 0.0, 0.0, 0.0, z, 0.0, 0.0, 0.0, 0.0,
                              1.0);
}

void skewedAxes(Recorder& out) {
  const double h = kVoxel;
  out.expectRefusal("grid with voxels of 1 × 1 × 2", ExitCode::Input,
                    [&] { (void)levelset::importBand(onAxes(axes(h, h, 2 * h, 0))); });
  out.expectRefusal("grid with sheared axes", ExitCode::Input,
                    [&] { (void)levelset::importBand(onAxes(axes(h, h, h, 0.3 * h))); });
  out.expectRefusal("grid with left-handed axes", ExitCode::Input,
                    [&] { (void)levelset::importBand(onAxes(axes(-h, h, h, 0))); });
  const auto bakes = [&](const char* name, const M44d& matrix, double volume, const auto& isError) {
    out.expect(name, "the volume error as measured before, and a sound band", [=] {
      const NarrowBand made = levelset::bake(solid(), matrix, kVoxel);
      const double error = levelset::measure(made).volume / (volume * *ball(V3d(0), 1).volume) - 1;
      const bool sound = levelset::check(made).passed();
      return std::pair{isError(error) && sound, fmt::format("volume {:+.3g} %, {}", 100 * error,
                                                            sound ? "sound" : "not sound")};
    });
  };
  M44d stretch, mirror, shear;
  stretch.setScale(V3d(1, 1, 2));
  mirror.setScale(V3d(-1, 1, 1));
  shear[1][0] = 0.5;
  bakes("stretched by 1 × 1 × 2 and baked", stretch, 2,
        [](double error) { return isAsMeasured(error, 8.5e-7); });
  bakes("mirrored and baked", mirror, 1, [](double error) { return isRounding(error, 0.01); });
  bakes("sheared by 0.5 and baked", shear, 1,
        [](double error) { return isAsMeasured(error, 1.28e-6); });
}

}  // namespace

void addBadInputCases(std::vector<Case>& all) {
  const auto add = [&](const char* name, const char* title, const char* definition,
                       void (*run)(Recorder&)) {
    all.push_back(statedCase(name, title, definition, "stated outcomes", run));
  };
  add("huge-offsets", "offsets to nothing and to a hundred times the object",
      "A sphere with a radius of 16 voxels. Impossible offsets are refused before memory is "
      "allocated. The offset by 100 that needs too much memory succeeds on coarser voxels.",
      hugeOffsets);
  add("empty-and-full", "bands without a surface",
      "Empty bands, bands without a change of sign, a block of equal values and a single voxel.",
      emptyAndFull);
  add("damaged-grids", "NaN, infinity and a background other than the half width",
      "Grids as programs can create them and damaged files can contain them.", damagedGrids);
  add("skewed-axes", "anisotropic, sheared and left-handed transforms",
      "Grids with such axes are refused. A solid that is moved by such a matrix is baked: "
      "resampled on a uniform grid.",
      skewedAxes);
}

}  // namespace regress
