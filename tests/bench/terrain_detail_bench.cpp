// Level of detail of fractal terrains: triangles, and times to choose and to draw them, against
// size, pixel error and patch size. Usage: terrain_detail_bench [POWER …]; terrains have 2^POWER +
// 1 samples a side, 10 to 14 without arguments. The largest takes 1.1 GB. Rows are means over a
// flight of 12 views at 1024x768 pixels, 60 to 240 samples above the ground. The flight is the same
// on all terrains, in the middle, and looks along the ground. The first pass reads patches and
// sends them to the device; the rest is of the second pass. Times are CPU times of all threads.
// With Mesa's llvmpipe they contain the drawing.
#include <fmt/core.h>
#include <tbb/parallel_for.h>

#include <cmath>
#include <cstdlib>
#include <ctime>
#include <memory>
#include <vector>

#include "render/gpu/terrain/terrain_painter.h"
#include "render/terrain/terrain_detail.h"
#include "tests/support/terrain_stores.h"

namespace {

using levelset::HeightField;
using render::Camera;
using render::TerrainDetail;

constexpr int kViews = 12;

/// CPU time of all threads, milliseconds.
double cpuMilliseconds() {
  timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return 1e3 * static_cast<double>(now.tv_sec) + 1e-6 * static_cast<double>(now.tv_nsec);
}

std::shared_ptr<const HeightField> fractal(int power) {
  return std::make_shared<HeightField>(support::fractalTerrain(
      power, 0.4, 1,
      [](int rows, const auto& row) { tbb::parallel_for(0, rows, [&](int n) { row(n); }); }, 0.8));
}

std::vector<Camera> flightOver(const HeightField& field) {
  std::vector<Camera> views;
  for (int n = 0; n < kViews; ++n) {
    Camera camera;
    const int column = field.columns / 2 - 100 + 16 * n, row = field.rows / 2;
    camera.from = field.point(column, row) + Imath::V3d(0, 0, n % 2 == 0 ? 60 : 240);
    const double angle = 0.5 * n;
    camera.to = camera.from + Imath::V3d(std::cos(angle), std::sin(angle), -0.15);
    camera.up = {0, 0, 1};
    camera.verticalFov = 0.8;
    camera.width = 1024;
    camera.height = 768;
    views.push_back(camera);
  }
  return views;
}

struct Row {
  double patches = 0, triangles = 0, first = 0, select = 0, draw = 0, memory = 0;
};

Row measure(TerrainDetail& detail, render::TerrainPainter& painter,
            const std::vector<Camera>& views, double pixelError) {
  Row row;
  const double cold = cpuMilliseconds();
  for (const Camera& camera : views) (void)painter.draw(detail.select(camera, pixelError), camera);
  row.first = (cpuMilliseconds() - cold) / kViews;
  for (const Camera& camera : views) {
    double start = cpuMilliseconds();
    const render::TerrainSelection selection = detail.select(camera, pixelError);
    row.select += (cpuMilliseconds() - start) / kViews;
    start = cpuMilliseconds();
    (void)painter.draw(selection, camera);
    row.draw += (cpuMilliseconds() - start) / kViews;
    row.patches += static_cast<double>(selection.parts.size()) / kViews;
    row.triangles += static_cast<double>(painter.cost().triangles) / kViews;
  }
  row.memory = static_cast<double>(detail.memoryUse()) / (1 << 20);
  return row;
}

void printHeader(const char* first) {
  fmt::print("{:>8} {:>9} {:>11} {:>9} {:>10} {:>9} {:>12} {:>10}\n", first, "patches", "triangles",
             "first ms", "select ms", "draw ms", "Mtriangles/s", "heights MB");
}
void print(const std::string& name, const Row& row) {
  fmt::print("{:>8} {:>9.0f} {:>11.0f} {:>9.1f} {:>10.2f} {:>9.1f} {:>12.1f} {:>10.1f}\n", name,
             row.patches, row.triangles, row.first, row.select, row.draw,
             row.triangles / row.draw / 1000, row.memory);
  std::fflush(stdout);
}

struct Drawn {
  TerrainDetail detail;
  std::unique_ptr<render::TerrainPainter> painter;
  Drawn(const std::shared_ptr<const HeightField>& field, const levelset::HeightPyramid& pyramid)
      : detail(levelset::patchStoreOf(field, pyramid), {.maxBytes = std::size_t{512} << 20}),
        painter(render::makeTerrainPainter(detail.layout(), std::size_t{256} << 20)) {}
};

void compareErrorsAndPatches(const std::shared_ptr<const HeightField>& field,
                             const levelset::HeightPyramid& pyramid) {
  const std::vector<Camera> views = flightOver(*field);
  fmt::print("\nPixel error, {}x{} samples, patches of 33x33\n", field->columns, field->rows);
  printHeader("pixels");
  for (const double pixelError : {0.5, 1.0, 2.0, 4.0, 8.0}) {
    Drawn drawn(field, pyramid);
    print(fmt::format("{}", pixelError), measure(drawn.detail, *drawn.painter, views, pixelError));
  }
  fmt::print("\nPatch size, {}x{} samples, 1 pixel\n", field->columns, field->rows);
  printHeader("side");
  for (const int cells : {16, 32, 64}) {
    Drawn drawn(field, cells == 32 ? pyramid : levelset::heightPyramid(*field, {.cells = cells}));
    print(fmt::format("{}", cells + 1), measure(drawn.detail, *drawn.painter, views, 1));
  }
}

}  // namespace

int main(int argc, char** argv) {
  std::vector<int> powers;
  for (int n = 1; n < argc; ++n) powers.push_back(std::atoi(argv[n]));
  if (powers.empty()) powers = {10, 11, 12, 13, 14};
  fmt::print("Terrain size, 1 pixel, patches of 33x33\n");
  printHeader("samples");
  std::shared_ptr<const HeightField> field;
  levelset::HeightPyramid pyramid;
  for (const int power : powers) {
    field = fractal(power);
    const double start = cpuMilliseconds();
    pyramid = levelset::heightPyramid(*field, {.cells = 32});
    const double built = (cpuMilliseconds() - start) / 1000;
    Drawn drawn(field, pyramid);
    print(fmt::format("{}", field->columns),
          measure(drawn.detail, *drawn.painter, flightOver(*field), 1));
    fmt::print("         pyramid built in {:.2f} s\n", built);
  }
  compareErrorsAndPatches(field, pyramid);
  return 0;
}
