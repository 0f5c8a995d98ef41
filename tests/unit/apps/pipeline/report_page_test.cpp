#include "apps/pipeline/report/report_page.h"

#include <fmt/core.h>
#include <gtest/gtest.h>

#include <limits>
#include <nlohmann/json.hpp>
#include <set>
#include <tuple>

#include "apps/html_text.h"
#include "apps/pipeline/report/report.h"
#include "apps/pipeline/report/versions.h"
#include "levelset/shapes/shapes.h"
#include "render/shading/style.h"
#include "tests/support/command_line.h"
#include "tests/support/files.h"
#include "tests/support/html.h"
#include "tests/support/tolerance_runs.h"

namespace report_page_test {

using Json = nlohmann::json;
using support::HtmlPage;
using support::HtmlTag;

pipeline::RunReport runDrawn(const std::string& chain) {
  return support::runWords(chain, {.measureErrors = true, .thumbnails = 100});
}

/// The report of a run without its costs.
pipeline::RunReport withoutCosts(pipeline::RunReport report) {
  for (pipeline::StepReport& step : report.steps)
    step.wallSeconds = step.cpuSeconds = step.peakBytes = 0;
  if (report.tolerance)
    for (pipeline::ToleranceRound& round : report.tolerance->rounds) round.seconds = 0;
  return report;
}

/// Expects a well-formed Unicode page without network access or scripts, and with text alternatives
/// for pictures.
void expectSound(const std::string& source) {
  const HtmlPage page(source);
  EXPECT_EQ(page.fault(), "");
  EXPECT_NO_THROW((void)Json(source).dump());  // throws unless the text is valid UTF-8
  for (const char* name : {"script", "link", "iframe", "object", "form"})
    EXPECT_TRUE(page.all(name).empty()) << name;
  for (const HtmlTag& image : page.all("img")) {
    EXPECT_FALSE(image.attributes.at("alt").empty());
    EXPECT_TRUE(image.attributes.at("src").starts_with("data:image/png;base64,"));
  }
  for (const HtmlTag& link : page.all("a"))
    EXPECT_TRUE(link.attributes.at("href").starts_with("data:application/json;base64,"));
  for (const HtmlTag& heading : page.all("th")) EXPECT_TRUE(heading.attributes.contains("scope"));
  EXPECT_EQ(page.all("caption").size(), page.all("table").size());
  EXPECT_EQ(source.find("url("), std::string::npos);
  EXPECT_EQ(source.find("@import"), std::string::npos);
}

std::string fromBase64(const std::string& text) {
  const std::string digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string bytes;
  unsigned bits = 0, count = 0;
  for (const char c : text) {
    if (c == '=') break;
    bits = bits << 6 | static_cast<unsigned>(digits.find(c));
    if ((count += 6) < 8) continue;
    count -= 8;
    bytes += static_cast<char>(bits >> count & 255);
  }
  return bytes;
}

/// Pictures of a page, in order.
std::vector<std::string> picturesOf(const std::string& source) {
  const std::string start = "data:image/png;base64,";
  std::vector<std::string> pictures;
  for (const HtmlTag& image : HtmlPage(source).all("img"))
    pictures.push_back(fromBase64(image.attributes.at("src").substr(start.size())));
  return pictures;
}

/// Expects a picture of a shaded object: the right size, and many colours over a large part.
void expectPicture(const std::string& png) {
  const support::TemporaryFolder folder;
  support::writeText(folder / "a.png", png);
  const render::ColourImage image = render::readColourPng(folder / "a.png");
  EXPECT_EQ(image.width, pipeline::kThumbnailWidth);
  EXPECT_EQ(image.height, pipeline::kThumbnailHeight);
  std::set<std::tuple<float, float, float>> colours;
  std::size_t covered = 0;
  for (const Imath::C3f& c : image.pixels) {
    colours.insert({c.x, c.y, c.z});
    covered += c.x > 0;
  }
  EXPECT_GT(colours.size(), 50u);
  EXPECT_GT(covered, image.pixels.size() / 10);
  EXPECT_LT(covered, image.pixels.size());
}

TEST(HtmlText, EncodesLikeTheStandard) {
  const std::vector<std::pair<std::string, std::string>> vectors = {{"", ""},
                                                                    {"f", "Zg=="},
                                                                    {"fo", "Zm8="},
                                                                    {"foo", "Zm9v"},
                                                                    {"foob", "Zm9vYg=="},
                                                                    {"fooba", "Zm9vYmE="},
                                                                    {"foobar", "Zm9vYmFy"}};
  for (const auto& [bytes, text] : vectors) EXPECT_EQ(apps::base64(bytes), text);
  EXPECT_EQ(apps::base64(std::string("\x00\xFF\x10", 3)), "AP8Q");
}

TEST(HtmlText, KeepsUnicodeAndReplacesInvalidBytes) {
  const std::string kMark = "\xEF\xBF\xBD";
  EXPECT_EQ(apps::escapedHtml("a<b>&\"'"), "a&lt;b&gt;&amp;&quot;&#39;");
  for (const std::string good :
       {"größe ≤ 3", "\xF0\x9F\x8D\xA9", "\xED\x9F\xBF", "\xF4\x8F\xBF\xBF"})
    EXPECT_EQ(apps::escapedHtml(good), good);
  // A lone continuation byte, overlong forms, a surrogate, a value beyond Unicode, and a truncated
  // sequence.
  for (const std::string bad : {"\x80", "\xC0\xAF", "\xE0\x80\xAF", "\xED\xA0\x80",
                                "\xF4\x90\x80\x80", "\xE2\x82", "\xF0\x9F\x8D", "\xFF"})
    EXPECT_TRUE(apps::escapedHtml(bad).starts_with(kMark)) << Json(apps::base64(bad));
  EXPECT_EQ(apps::escapedHtml(std::string("a\0b\x1b", 4)), "a" + kMark + "b" + kMark);
  EXPECT_EQ(apps::escapedHtml("\xE2\x82<"), kMark + kMark + "&lt;");
}

TEST(ReportPage, ReportsEveryStepOfARun) {
  const support::TemporaryFolder folder;
  const std::string file = (folder / "a.ply").string();
  const std::string source = pipeline::reportPage(
      runDrawn("box --size 2,2,2 --voxel 0.1 ! mesh ! level-set --voxel 0.1 --as cube ! offset 2vx "
               "! mesh ! write " +
               file));
  expectSound(source);
  const HtmlPage page(source);
  EXPECT_TRUE(page.says("exit code 0: done"));
  EXPECT_TRUE(page.says("box --size 2,2,2 --voxel 0.1"));
  EXPECT_TRUE(page.says("offset 2vx"));
  EXPECT_TRUE(page.says("distance = 0.2 = 2 vx written 2vx"));
  EXPECT_TRUE(page.says("@cube"));
  EXPECT_TRUE(page.says("active voxels"));
  EXPECT_TRUE(page.says("triangles"));
  EXPECT_TRUE(page.says("eikonal residual, mean"));
  EXPECT_TRUE(page.says("\"closed\": true"));
  EXPECT_TRUE(page.says("levelsmith run graph.json"));
  EXPECT_TRUE(page.says("\"op\": \"level-set\""));
  EXPECT_EQ(page.all("tbody").size(), 6u + 1);  // and the row of the versions
  EXPECT_EQ(page.all("img").size(), 5u);
}

TEST(ReportPage, ContainsTheGraphAsAFile) {
  const pipeline::RunReport report = runDrawn("sphere --radius 1 --voxel 0.2 --as ball");
  const std::string start = "data:application/json;base64,";
  const std::vector<HtmlTag> links = HtmlPage(pipeline::reportPage(report)).all("a");
  ASSERT_EQ(links.size(), 1u);
  const std::string graph = fromBase64(links[0].attributes.at("href").substr(start.size()));
  EXPECT_EQ(graph, report.graphJson);
  EXPECT_EQ(Json::parse(graph)["nodes"][0]["as"], "ball");
}

TEST(ReportPage, EscapesTextFromOthers) {
  const std::string evil = "\"><script>alert('1')</script>&amp;\n' onerror='x\xFF\x01";
  const std::string shown =
      "\"><script>alert('1')</script>&amp;\n' onerror='x\xEF\xBF\xBD\xEF\xBF\xBD";
  pipeline::RunReport report;
  pipeline::StepReport& step = report.steps.emplace_back();
  step.action = step.resultName = step.resultKind = step.location = evil;
  step.defaults = {{"b", evil}};
  step.notes.lengths = {{.param = evil, .written = evil, .world = 1, .voxels = {}}};
  step.notes.warnings = step.notes.notes = {evil};
  step.notes.errors = {{evil, 1, evil}};
  step.notes.certificateJson = step.notes.detailsJson = evil;
  step.thumbnail.missing = evil;
  report.steps.push_back(step);
  report.steps.back().thumbnail = {.png = "bytes", .missing = {}};
  report.warnings = report.leftOut = {evil};
  report.error = report.graphJson = evil;
  report.exitCode = 3;
  report.tolerance.emplace();
  report.tolerance->written = evil;
  report.tolerance->models = {evil};
  report.tolerance->outputs.resize(1);
  report.tolerance->outputs[0].name = evil;
  report.tolerance->rounds.resize(1);
  report.tolerance->rounds[0].outputs = report.tolerance->outputs;
  report.tolerance->rounds[0].failure = evil;
  report.tolerance->limit = evil;
  const std::string source = pipeline::reportPage(report);
  expectSound(source);
  const HtmlPage page(source);
  // 4 + 1 + 2 + 2 + 2 + 2 for each step, one reason for a missing picture, and the rest once.
  EXPECT_EQ(page.countOf(shown), 2 * 13u + 1 + 4 + 6);
  EXPECT_NE(page.all("img").at(0).attributes.at("alt").find(shown), std::string::npos);
}

TEST(ReportPage, WritesActionsAsAShellAcceptsThem) {
  pipeline::RunReport report;
  const auto add = [&](const std::string& action, std::map<std::string, std::string> parameters) {
    report.steps.emplace_back();
    report.steps.back().action = action;
    report.steps.back().parameters = std::move(parameters);
  };
  add("write", {{"file", "two words.ply"}});
  add("write", {{"file", "it's $HOME"}, {"format", "ply"}});
  add("compare-images", {{"second", "b.exr"}, {"exact", "true"}});
  add("offset", {{"distance", "-0.2"}});
  const HtmlPage page(pipeline::reportPage(report));
  EXPECT_TRUE(page.says("write 'two words.ply'"));
  EXPECT_TRUE(page.says("write 'it'\\''s $HOME' --format ply"));
  EXPECT_TRUE(page.says("compare-images --exact --second b.exr"));
  EXPECT_TRUE(page.says("offset -0.2"));
}

TEST(ReportPage, ShowsComputedAndNeededRegions) {
  const support::TemporaryFolder folder;
  const std::string file = (folder / "a.ply").string();
  const std::string chain =
      "sphere --radius 4 --voxel 0.1 --half-width 7 ! offset 0.1 ! clip --box 2,2,2_5,5,5 ! mesh ! "
      "write " +
      file;
  std::vector<std::string> words = support::wordsOf(chain);
  for (std::string& word : words) std::replace(word.begin(), word.end(), '_', ' ');
  pipeline::RunReport report;
  pipeline::RunSettings settings{.thumbnails = 100};
  settings.warn = settings.note = settings.print = [](const std::string&) {};
  pipeline::run(pipeline::parseChain(words), settings, report);
  const pipeline::StepReport& sphere = report.steps.at(0);
  ASSERT_FALSE(levelset::isEverywhere(sphere.roi.region));
  ASSERT_TRUE(std::isfinite(sphere.roi.halfWidth));
  const std::string source = pipeline::reportPage(report);
  expectSound(source);
  const HtmlPage page(source);
  EXPECT_TRUE(
      page.says(fmt::format("±{:.4g} vx = ±{:.4g}", sphere.halfWidth, sphere.halfWidth * 0.1)));
  EXPECT_TRUE(page.says(fmt::format("±{:.4g} vx = ±{:.4g}the box from", sphere.roi.halfWidth,
                                    sphere.roi.halfWidth * 0.1)));
  EXPECT_TRUE(page.says(fmt::format("{:.6g}, {:.6g}, {:.6g}", sphere.roi.region.min.x,
                                    sphere.roi.region.min.y, sphere.roi.region.min.z)));
  // A band computed for itself is needed completely.
  const HtmlPage whole(pipeline::reportPage(runDrawn("sphere --radius 1 --voxel 0.1")));
  EXPECT_TRUE(whole.says("±3 vx = ±0.3all"));
  EXPECT_FALSE(whole.says("the box from"));
}

TEST(ReportPage, DrawsLevelSetsMeshesAndScenes) {
  const std::vector<std::string> pictures = picturesOf(pipeline::reportPage(
      runDrawn("torus --radius 2 --tube 0.7 --voxel 0.1 ! mesh ! sphere --radius 1 --voxel 0.1 "
               "--as a ! scene @a")));
  ASSERT_EQ(pictures.size(), 4u);
  for (const std::string& png : pictures) expectPicture(png);
  EXPECT_NE(pictures[0], pictures[1]);  // its mesh is flat-shaded
  EXPECT_NE(pictures[0], pictures[2]);
  EXPECT_EQ(pictures[2], pictures[3]);  // a scene of the sphere alone
}

TEST(ReportPage, StatesWhyAPictureIsMissing) {
  const auto missing = [](const pipeline::Value& value,
                          std::size_t memory = levelset::kNoMemoryLimit) {
    const pipeline::Thumbnail picture = pipeline::thumbnailOf(value, memory);
    EXPECT_TRUE(picture.png.empty());
    return picture.missing;
  };
  const levelset::NarrowBand ball = levelset::makeSphere(1, {0, 0, 0}, 0.1);
  EXPECT_EQ(missing(pipeline::Value(levelset::TriMesh())), "the value has no surface to draw");
  levelset::TriMesh nowhere;
  nowhere.positions.assign(3, Imath::V3d(std::numeric_limits<double>::quiet_NaN()));
  nowhere.triangles = {{0, 1, 2}};
  EXPECT_EQ(missing(pipeline::Value(nowhere)), "the value has no surface to draw");
  EXPECT_EQ(missing(pipeline::Value(ball), 1 << 20), "too little memory is left");
  EXPECT_EQ(missing(pipeline::Value(pipeline::PatchValue())), "a patch has no thumbnail");
  const HtmlPage page(
      pipeline::reportPage(runDrawn("sphere --radius 1 --voxel 0.1 ! march --speed 1 --to 0.2")));
  EXPECT_EQ(page.all("img").size(), 1u);
  EXPECT_TRUE(page.says("no picture: a field has no thumbnail"));
}

TEST(ReportPage, DrawsTheRequestedNumberOfPictures) {
  const std::string chain = "sphere --radius 1 --voxel 0.2 ! offset 0.1";
  const auto drawn = [&](std::size_t count, bool dryRun) {
    const std::string page =
        pipeline::reportPage(support::runWords(chain, {.dryRun = dryRun, .thumbnails = count}));
    expectSound(page);
    return picturesOf(page).size();
  };
  EXPECT_EQ(drawn(0, false), 0u);
  EXPECT_EQ(drawn(1, false), 1u);
  EXPECT_EQ(drawn(9, false), 2u);
  EXPECT_EQ(drawn(9, true), 0u);
}

TEST(ReportPage, IsEqualForEqualRuns) {
  const std::string chain = "torus --radius 2 --tube 0.7 --voxel 0.1 ! offset 0.1 ! mesh";
  const auto page = [&] { return pipeline::reportPage(withoutCosts(runDrawn(chain))); };
  EXPECT_EQ(page(), page());
}

TEST(ReportPage, ReportsADryRun) {
  const std::string source = pipeline::reportPage(
      support::runWords("sphere --radius 1 --voxel 0.1 ! offset 1vx", {.dryRun = true}));
  expectSound(source);
  const HtmlPage page(source);
  EXPECT_TRUE(page.says("dry run, nothing was computed; exit code 0"));
  EXPECT_TRUE(page.says("about"));
  EXPECT_TRUE(page.says("distance = 0.1 = 1 vx"));
  EXPECT_FALSE(page.says("picture"));
}

TEST(ReportPage, ReportsTheResultOfATolerance) {
  const support::ToleranceRun run =
      support::runToTolerance("1%", "sphere --radius 1 ! mesh", {.thumbnails = 100});
  ASSERT_EQ(run.refusal, "");
  ASSERT_FALSE(run.told().rounds.empty());
  const std::string source = pipeline::reportPage(run.report);
  expectSound(source);
  const HtmlPage page(source);
  EXPECT_TRUE(page.says("Requested: 1%"));
  EXPECT_TRUE(page.says("requestedachievedreached"));
  EXPECT_TRUE(
      page.says(fmt::format("{:.4g}{:.3g}yes", run.output().requested, run.output().achieved)));
  for (const pipeline::ToleranceRound& round : run.told().rounds)
    EXPECT_TRUE(page.says(fmt::format("{:.4g}", round.voxelSize)));
  EXPECT_EQ(page.countOf("kept"), 1u);
  for (const std::string& png : picturesOf(source)) expectPicture(png);
  EXPECT_EQ(picturesOf(source).size(), 2u);

  pipeline::RunReport missed = run.report;
  missed.tolerance->outputs[0].requested = missed.tolerance->outputs[0].achieved / 2;
  EXPECT_TRUE(
      HtmlPage(pipeline::reportPage(missed)).says(fmt::format("{:.3g}no", run.output().achieved)));
}

TEST(ReportPage, NamesTheVersionsOfItsParts) {
  const HtmlPage page(pipeline::reportPage({}));
  EXPECT_EQ(page.fault(), "");
  const Json json = Json::parse(pipeline::reportJson({}));
  EXPECT_EQ(json["version"], json["versions"]["levelsmith"]);
  for (const char* name : {"OpenVDB", "NanoVDB", "Embree", "TBB", "OpenEXR", "Imath", "Eigen",
                           "libpng", "zlib", "fmt", "compiler"}) {
    ASSERT_TRUE(json["versions"].contains(name)) << name;
    const std::string version = json["versions"][name];
    EXPECT_NE(version.find_first_of("0123456789"), std::string::npos) << name;
    EXPECT_TRUE(page.says(name + version)) << name;
  }
  EXPECT_EQ(json["versions"].size(), pipeline::programVersions().size());
}

class ReportPageCommand : public support::ShellTest {};

TEST_F(ReportPageCommand, IsWrittenForAFailedRun) {
  writeFile("broken.ply", "ply\nformat ascii 1.0\nend_header\n");
  const auto outcome = levelsmith(
      "--report r.html sphere --radius 1 --voxel 0.1 ! write a.vdb ! read broken.ply ! measure");
  ASSERT_NE(outcome.code, 0);
  const std::string source = support::slurp(folder_ / "r.html");
  expectSound(source);
  const HtmlPage page(source);
  EXPECT_TRUE(page.says("exit code " + std::to_string(outcome.code)));
  const std::string prefix = "levelsmith: ";
  const std::size_t begin = outcome.err.rfind(prefix) + prefix.size();
  const std::string sentence = outcome.err.substr(begin, outcome.err.find('\n', begin) - begin);
  EXPECT_TRUE(sentence.find("broken.ply") != std::string::npos && page.says(sentence)) << sentence;
  ASSERT_EQ(picturesOf(source).size(), 1u);
  expectPicture(picturesOf(source)[0]);
}

TEST_F(ReportPageCommand, EscapesHostileNames) {
  const auto outcome = levelsmith(
      "--report 'r.html' sphere --radius 1 --voxel 0.2 ! write $'<b>\"\\xff&lt;.vdb' ! measure");
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  const std::string source = support::slurp(folder_ / "r.html");
  expectSound(source);
  EXPECT_TRUE(HtmlPage(source).says("write '<b>\"\xEF\xBF\xBD&lt;.vdb'"));
}

TEST_F(ReportPageCommand, ReportsResultsOfAnEarlierRun) {
  const std::string chain =
      "--cache kept --report r.html sphere --radius 1 --voxel 0.1 ! offset 0.1 ! write ";
  ASSERT_EQ(levelsmith(chain + "a.vdb").code, 0);
  EXPECT_FALSE(HtmlPage(support::slurp(folder_ / "r.html")).says("from an earlier run"));
  ASSERT_EQ(levelsmith(chain + "b.vdb").code, 0);
  const std::string source = support::slurp(folder_ / "r.html");
  expectSound(source);
  EXPECT_EQ(HtmlPage(source).countOf("from an earlier run"), 2u);
  ASSERT_EQ(picturesOf(source).size(), 1u);  // the picture of the cached result
  expectPicture(picturesOf(source)[0]);
}

TEST_F(ReportPageCommand, ReportsTheScriptLineOfAStep) {
  writeFile("a.pipeline",
            "sphere --radius 1 --voxel 0.2\n\nmeasure\ntorus --radius 2 --tube 1 --voxel 0.5\n");
  ASSERT_EQ(levelsmith("--report r.html run a.pipeline").code, 0);
  const std::string source = support::slurp(folder_ / "r.html");
  expectSound(source);
  const HtmlPage page(source);
  EXPECT_TRUE(page.says("line 3"));
  EXPECT_TRUE(page.says("not used"));
  EXPECT_TRUE(page.says("Left out, because no requested result depends on it\n\ntorus"));
}

}  // namespace report_page_test
