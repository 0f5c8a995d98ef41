// The action `effect`, and presets and lights of `render`.

#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "render/images/compare_images.h"
#include "render/images/image.h"
#include "tests/support/action_test.h"

namespace effect_action_test {

class EffectAction : public support::ActionTest {
 protected:
  void draw(const std::string& options = "") {
    const support::Outcome outcome = levelsmith(
        "torus --radius 2 --tube 0.8 --voxel 0.1 ! render in.exr --size 96x72 --samples 1 " +
        options);
    ASSERT_EQ(outcome.code, 0) << outcome.err;
  }
  render::Image read(const std::string& name) { return render::readExr(folder_ / name); }
};

TEST_F(EffectAction, WritesPicturesWithLayers) {
  draw();
  support::Outcome outcome = levelsmith(
      "effect in.exr out.exr --outline 2 --occlusion 0.5 --shadow 0.5 --depth-cue 0.5 --halo 3 "
      "--solid-texture wood --reflect 0.1 --background 1,1,1");
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  const render::Image image = read("out.exr");
  for (const char* layer : {"outline", "light.sky", "light.key", "Z", "N.X", "A"})
    EXPECT_TRUE(image.channels.contains(layer)) << layer;
  EXPECT_EQ(image.channels.at("A")[0], 1.0f);
  outcome = levelsmith("effect in.exr --write half.png --reduce 2 --stereo anaglyph");
  EXPECT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_TRUE(exists("half.png"));
}

TEST_F(EffectAction, HasTheSameBitsOnBothProcessors) {
  draw();
  for (const char* renderer : {"cpu", "gpu"}) {
    const support::Outcome outcome =
        levelsmith(std::string("effect in.exr ") + renderer +
                   ".exr --outline 2 --occlusion 1 --shadow 1 --renderer " + renderer);
    ASSERT_EQ(outcome.code, 0) << outcome.err;
  }
  EXPECT_EQ(levelsmith("compare-images cpu.exr gpu.exr --exact").code, 0);
}

TEST_F(EffectAction, ComparesLightInThePictureWithTracedLight) {
  draw("--light-layers");
  ASSERT_EQ(levelsmith("effect in.exr out.exr --occlusion 1 --shadow 1").code, 0);
  const nlohmann::json found = json("compare-images in.exr out.exr --difference d.exr --json");
  bool hasSky = false;
  for (const auto& layer : found["layers"]) hasSky = hasSky || layer["layer"] == "light.sky";
  EXPECT_TRUE(hasSky) << found.dump();
  EXPECT_TRUE(read("d.exr").channels.contains("light.key"));
}

TEST_F(EffectAction, RefusesWithASentence) {
  draw();
  expectRefusal("effect in.exr out.png --xray 1", 3, "--thickness");
  expectRefusal("effect in.exr out.gif --outline 1", 2, "format");
  expectRefusal("effect in.exr out.png --occlusion 3", 2, "from 0 to 1");
  expectRefusal("effect missing.exr out.png --outline 1", 6, "missing.exr");
  expectRefusal("effect in.exr out.png --right in.exr", 2, "--stereo");
  expectRefusal("effect in.exr out.png --reflect 1 --environment in.exr", 3, "twice as wide");
  expectRefusal("effect in.exr out.png --reduce 100", 2, "at most 16");
  expectRefusal("effect in.exr out.png --reduce 5", 2, "a divisor of both edges");
  expectRefusal("effect in.exr out.png --reduce 16 --halo 100", 2, "--halo 100 is too wide");
  expectRefusal("effect missing.exr out.png --reduce 16 --outline 8", 2, "at most 7.5 pixels");
  expectRefusal("effect in.exr out.png --shadow 1 --light 0,-0,0", 2, "is not a direction");
  EXPECT_FALSE(exists("out.png"));
}

TEST_F(EffectAction, RefusesOptionsThatWouldBeIgnored) {
  const std::string effect = "effect in.exr out.png ";
  expectRefusal(effect + "--environment studio", 2, "--reflect or --refract");
  expectRefusal(effect + "--index 1.3 --reflect 1", 2, "--index is for --refract");
  expectRefusal(effect + "--light 0,1,0", 2, "--shadow");
  expectRefusal(effect + "--light-radius 5 --occlusion 1", 2, "--shadow");
  expectRefusal(effect + "--occluder-depth 1", 2, "--occlusion or --shadow");
  expectRefusal(effect + "--occlusion-radius 1 --shadow 1", 2, "--occlusion");
  expectRefusal(effect + "--texture-size 1 --solid-texture none", 2, "--solid-texture");
  for (const char* option : {"--eye-distance 1", "--screen-depth 1"}) {
    expectRefusal(effect + option, 2, "--stereo");
    expectRefusal(effect + option + " --stereo anaglyph --right in.exr", 2, "--right");
  }
}

TEST_F(EffectAction, CombinesTwoDrawnPictures) {
  draw();
  ASSERT_EQ(levelsmith("effect in.exr both.exr --right in.exr --stereo side-by-side").code, 0);
  EXPECT_EQ(read("both.exr").width, 192);
}

TEST_F(EffectAction, PresetsSetOptionsThatAreNotGiven) {
  const std::string torus = "torus --radius 2 --tube 0.8 --voxel 0.1 ! render ";
  for (const char* preset : {"paper", "clay", "technical", "molecule", "xray"}) {
    const support::Outcome outcome =
        levelsmith(torus + preset + ".exr --size 60x45 --preset " + preset);
    ASSERT_EQ(outcome.code, 0) << outcome.err;
    const render::Image image = read(std::string(preset) + ".exr");
    EXPECT_EQ(image.width, 60) << preset;
    EXPECT_EQ(image.channels.at("A")[0], 1.0f) << preset;
  }
  // The preset is its options.
  ASSERT_EQ(levelsmith(torus + "same.exr --size 60x45 --style tone --outline 2 --crease-angle 25 "
                               "--background 1,1,1 --reduce 3 --samples 1")
                .code,
            0);
  EXPECT_EQ(read("same.exr").channels, read("technical.exr").channels);
  ASSERT_EQ(levelsmith(torus + "other.exr --size 60x45 --preset clay --style tone --reduce 1").code,
            0);
  EXPECT_EQ(read("other.exr").attributes.at("ls:style"), "tone");
  expectRefusal(torus + "x.png --preset cake", 2, "paper");
  expectRefusal(torus + "x.png --size 60x45 --preset paper --outline 41", 2, "at most 40 pixels");
  // A volume has no shadow on the ground of this preset.
  const support::Outcome volume = levelsmith(
      "volume sphere --size 12 ! render volume.png --size 32x24 --preset clay --samples 1 "
      "--transfer auto");
  EXPECT_EQ(volume.code, 0) << volume.err;
}

TEST_F(EffectAction, PartsWithTheirOwnColoursAreNotColoured) {
  writeFile("co.pdb",
            "ATOM      1  C   GLY A   1       0.000   0.000   0.000  1.00  5.00           C\n"
            "ATOM      2  O   GLY A   1       1.200   0.000   0.000  1.00 25.00           O\n"
            "END\n");
  const std::string atoms = "read co.pdb ! render x.png --size 32x24 --samples 1 ";
  expectRefusal(atoms + "--colour 1,0,0", 2, "leave --colour out");
  expectRefusal(atoms + "--preset xray", 2, "use another --preset");
  expectRefusal(atoms + "--xray 1", 2, "leave it out");
  const support::Outcome drawn = levelsmith(atoms + "--preset molecule");
  EXPECT_EQ(drawn.code, 0) << drawn.err;
}

TEST_F(EffectAction, LightsOfRenderAreChecked) {
  const std::string torus = "torus --radius 2 --tube 0.8 --voxel 0.1 ! render x.png --size 32x24 ";
  expectRefusal(torus + "--light-radius 90", 2, "85 degrees");
  expectRefusal(torus + "--colour 1,2,3", 2, "from 0 to 1");
  expectRefusal(torus + "--light-layers", 2, "PNG has no layers");
  expectRefusal(torus + "--light 0,0,0", 2, "light");
}

TEST_F(EffectAction, TracesReflectionAndRefraction) {
  draw("--reflect 0.2 --refract 0.5 --index 1.4 --bounces 3");
  const render::Image traced = read("in.exr");
  draw("--reflect 0.2 --refract 0.5 --index 1.4 --bounces 3 --renderer gpu");
  EXPECT_EQ(read("in.exr").channels, traced.channels);
  draw();
  EXPECT_EQ(read("in.exr").channels.at("Z"), traced.channels.at("Z"));
  EXPECT_NE(read("in.exr").channels.at("R"), traced.channels.at("R"));
  // Zero is off.
  const render::Image plain = read("in.exr");
  draw("--reflect 0");
  EXPECT_EQ(read("in.exr").channels, plain.channels);
}

TEST_F(EffectAction, DrawsBothEyes) {
  const std::string torus = "torus --radius 2 --tube 0.8 --voxel 0.1 ! render ";
  const std::string view = " --size 64x48 --samples 1 --from 0,2,7 --to 0,0,0 ";
  support::Outcome outcome =
      levelsmith(torus + "pair.exr --stereo side-by-side --outline 1 --background 1,1,1" + view);
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  const render::Image pair = read("pair.exr");
  EXPECT_EQ(pair.width, 128);
  EXPECT_EQ(pair.height, 48);
  outcome =
      levelsmith(torus + "glasses.png --stereo anaglyph --eye-distance 1 --screen-depth 6" + view);
  EXPECT_EQ(outcome.code, 0) << outcome.err;
  // An eye has the picture of its own camera. At an infinite depth of the screen, that is a camera
  // with a parallel axis.
  outcome = levelsmith(torus +
                       "far.exr --stereo side-by-side --eye-distance 0.5 --screen-depth "
                       "1e12" +
                       view + "! " + torus +
                       "right.exr --size 64x48 --samples 1 --from 0.25,2,7 --to 0.25,0,0");
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  const render::Image far = read("far.exr"), right = read("right.exr");
  std::size_t different = 0;
  for (int y = 0; y < 48; ++y)
    for (int x = 0; x < 64; ++x)
      different += std::abs(far.channels.at("A")[static_cast<std::size_t>(128 * y + 64 + x)] -
                            right.channels.at("A")[static_cast<std::size_t>(64 * y + x)]) > 0;
  EXPECT_EQ(different, 0u);
}

TEST_F(EffectAction, RefusesTracedEffectsWithASentence) {
  const std::string render = "sphere --radius 1 --voxel 0.1 ! render out.exr ";
  expectRefusal(render + "--reflect 2", 2, "--reflect 2 is out of range");
  expectRefusal(render + "--refract 1 --index 0.5", 2, "--index 0.5");
  expectRefusal(render + "--index 1.3 --reflect 1", 2, "--index is for --refract");
  expectRefusal(render + "--bounces 3", 2, "--reflect or --refract");
  expectRefusal(render + "--reflect 1 --bounces 1000", 2, "give 0 to 64");
  expectRefusal(render + "--environment studio", 2, "--reflect or --refract");
  expectRefusal(render + "--reflect 1 --environment none.exr", 6, "none.exr");
  expectRefusal(render + "--reflect 1 --style curvature-lines", 2, "curvature-lines");
  expectRefusal(render + "--eye-distance 1", 2, "--stereo");
  expectRefusal(render + "--stereo anaglyph --ortho 3 --from 0,0,9", 2, "--ortho");
  expectRefusal(render + "--stereo anaglyph --renderer both", 2, "two");
  expectRefusal(render + "--stereo anaglyph --thickness", 2, "--thickness would be lost");
  expectRefusal(render + "--stereo anaglyph --from 0,0,0 --to 0,0,1", 2, "--screen-depth");
  expectRefusal(render + "--stereo anaglyph --eye-distance 1 --screen-depth 1e-6", 2,
                "shifts the views");
  expectRefusal(render + "--reflect 0 --bounces 3", 2, "--bounces is for");
  EXPECT_FALSE(exists("out.exr"));
}

}  // namespace effect_action_test
