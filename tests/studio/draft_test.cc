#include "studio/draft.h"

#include <gtest/gtest.h>
#include <zlib.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <functional>
#include <numbers>
#include <string>
#include <vector>

#include "gamer/core/error.h"

namespace gamer::draft_test {
namespace {

using Json = nlohmann::json;

constexpr double rh = 0.06, z0 = 0.03, depth = 1.7, intensity = 3;

/// A disk and dust without textures; both are negligible where the taper begins.
DraftRequest smooth_galaxy() {
  DraftRequest request;
  request.document.parameters =
      "[image]\nsize = [32, 32]\n[camera]\nprojection = \"orthographic\"\nposition = [0, 0, 9]\n"
      "up = [0, 1, 0]\nwidth = 2\n[spectrum]\nwavelengths = [5500, 8000]\n";
  request.document.scene = "galaxy x y z ox oy oz pa size\nown 1 2 3 0 1 1 30 2\n";
  request.document.galaxies["own"] =
      "[[component]]\nclass = \"disk\"\nname = \"disk\"\nsed = \"flat\"\nintensity = 3\nrh = 0.06\n"
      "z0 = 0.03\nnoise = false\n[[component]]\nclass = \"dust\"\nname = \"lanes\"\nrh = 0.06\n"
      "z0 = 0.03\noptical_depth = 1.7\nnoise = false\n";
  request.size = 96;
  return request;
}

Draft draft_of(const DraftRequest& request) {
  static const Session session(2);
  return make_draft(session, "input", request, Cancellation());
}

std::string problem(const std::function<void(DraftRequest&)>& change) {
  DraftRequest request = smooth_galaxy();
  request.size = 16;
  change(request);
  try {
    draft_of(request);
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

/// The codes that packed_slices() packs when there are no variants: [number of the voxel][voxel].
std::vector<int> unpacked(const std::string& packed, std::size_t nodes, std::size_t slices) {
  const std::size_t numbers = nodes * nodes * slices * 4, plane = numbers / 4;
  std::string bytes(2 * numbers, '\0');
  uLongf size = bytes.size();
  EXPECT_EQ(uncompress(reinterpret_cast<Bytef*>(bytes.data()), &size,
                       reinterpret_cast<const Bytef*>(packed.data()), packed.size()),
            Z_OK);
  EXPECT_EQ(size, bytes.size());
  std::vector<int> codes(numbers);
  for (std::size_t i = 0; i < numbers; ++i) {
    const int folded =
        256 * static_cast<unsigned char>(bytes[i]) + static_cast<unsigned char>(bytes[numbers + i]);
    const int difference = folded % 2 == 0 ? folded / 2 : -(folded + 1) / 2;
    codes[i] = difference + (i % nodes == 0 ? 0 : codes[i - 1]);
  }
  for (std::size_t i = plane; i < 3 * plane; ++i) codes[i] += codes[i % plane];
  return codes;
}

double value_of(std::uint16_t half) {
  const int exponent = half >> 10, mantissa = half & 1023;
  return exponent == 0 ? std::ldexp(mantissa, -24) : std::ldexp(1024 + mantissa, exponent - 25);
}

/// One of the numbers of a voxel.
double number_at(const Draft& draft, int x, int y, int z, std::size_t number) {
  const std::size_t voxel = (std::size_t(z) * std::size_t(draft.axes[1].nodes) + std::size_t(y)) *
                                std::size_t(draft.axes[0].nodes) +
                            std::size_t(x);
  return value_of(draft.voxels[voxel * Draft::numbers + number]);
}

/// The integrals over x of the hat functions of all nodes, by the midpoint rule.
std::vector<double> weights(const DraftAxis& axis) {
  constexpr int steps = 64;
  std::vector<double> result(std::size_t(axis.nodes), 0.0);
  for (int i = 0; i + 1 < axis.nodes; ++i) {
    for (int k = 0; k < steps; ++k) {
      const double share = (k + 0.5) / steps;
      const double width = axis.place(i + (k + 1.0) / steps) - axis.place(i + double(k) / steps);
      result[std::size_t(i)] += (1 - share) * width;
      result[std::size_t(i) + 1] += share * width;
    }
  }
  return result;
}

TEST(DraftAxis, PlacesAreThoseOfIndices) {
  const DraftAxis axis{64, 0.01, 0.8};
  EXPECT_NEAR(axis.index(-1), 0, 1e-12);
  EXPECT_NEAR(axis.index(0), 31.5, 1e-12);
  EXPECT_NEAR(axis.index(1), 63, 1e-12);
  const std::vector<double> at = axis.places();
  ASSERT_EQ(at.size(), 64u);
  for (std::size_t i = 0; i < at.size(); ++i) {
    EXPECT_NEAR(axis.index(at[i]), double(i), 1e-9);
    EXPECT_NEAR(at[i], -at[63 - i], 1e-14);
    const double step = 1e-5;
    EXPECT_NEAR(axis.density(at[i]),
                (axis.index(at[i] + step) - axis.index(at[i] - step)) / (2 * step), 0.01);
  }
  EXPECT_LT(at[32] - at[31], 0.0025);
  EXPECT_GT(at[63] - at[62], 0.05);
}

TEST(Half, IsTheNearestOfIeee754) {
  EXPECT_EQ(half_of(0), 0);
  EXPECT_EQ(half_of(1), 0x3c00);
  EXPECT_EQ(half_of(2), 0x4000);
  EXPECT_EQ(half_of(65504), 0x7bff);
  EXPECT_EQ(half_of(1e9f), 0x7bff);
  EXPECT_EQ(half_of(0x1p-14f), 0x0400);
  EXPECT_EQ(half_of(0x1p-24f), 1);
  EXPECT_EQ(half_of(0x1p-26f), 0);
  // Ties go to even numbers.
  EXPECT_EQ(half_of(1 + 0x1p-11f), 0x3c00);
  EXPECT_EQ(half_of(1 + 3 * 0x1p-11f), 0x3c02);
  for (int bits = 0; bits <= 0x7bff; ++bits) {
    const auto half = static_cast<std::uint16_t>(bits);
    ASSERT_EQ(half_of(static_cast<float>(value_of(half))), half);
  }
}

// The integral of sech^2(z/z0) exp(-r/rh) is 4 pi rh^2 z0.
TEST(Draft, LightIsTheIntegralOfTheDisk) {
  const Draft draft = draft_of(smooth_galaxy());
  const std::vector<double> z = weights(draft.axes[2]), places = draft.axes[0].places();
  // Weights along x and y by the trapezoidal rule in the index.
  std::vector<double> x;
  for (const double place : places) x.push_back(1 / draft.axes[0].density(place));
  EXPECT_TRUE(draft.variants.empty());
  double sum = 0;
  for (int k = 0; k < draft.axes[2].nodes; ++k) {
    for (int j = 0; j < draft.axes[1].nodes; ++j) {
      for (int i = 0; i < draft.axes[0].nodes; ++i) {
        sum += x[std::size_t(i)] * x[std::size_t(j)] * z[std::size_t(k)] *
               number_at(draft, i, j, k, 0);
      }
    }
  }
  const double expected = intensity * 4 * std::numbers::pi * rh * rh * z0;
  EXPECT_NEAR(sum * draft.planes[0].light / expected, 1, 3e-3);
  EXPECT_EQ(draft.radius, 2);
  EXPECT_EQ(draft.centre, glm::dvec3(1, 2, 3));
}

// The optical depth through the layer is that of the parameter times exp(-r/rh).
TEST(Draft, DepthIsThatOfTheLayer) {
  const Draft draft = draft_of(smooth_galaxy());
  const std::vector<double> z = weights(draft.axes[2]);
  const std::vector<double> at = draft.axes[0].places();
  for (const int i : {48, 60, 70}) {
    double sum = 0;
    for (int k = 0; k < draft.axes[2].nodes; ++k) {
      sum += z[std::size_t(k)] * number_at(draft, i, 48, k, 3);
    }
    const double r = std::hypot(at[std::size_t(i)], at[48]);
    EXPECT_NEAR(sum * draft.depth / (depth * std::exp(-r / rh)), 1, 3e-3) << i;
  }
}

TEST(Draft, LacksWhatIsMuted) {
  DraftRequest request = smooth_galaxy();
  request.size = 16;
  request.muted = {1};
  const Draft clear = draft_of(request);
  EXPECT_EQ(clear.depth, 0);
  EXPECT_GT(clear.planes[0].light, 0);
  request.muted = {0};
  const Draft dark = draft_of(request);
  EXPECT_GT(dark.depth, 0);
  EXPECT_EQ(dark.planes[0].light, 0);
}

TEST(Draft, SlicesAreMessages) {
  DraftRequest request = smooth_galaxy();
  request.size = 192;
  const Draft draft = draft_of(request);
  std::vector<std::string> messages;
  std::string last = send_draft(draft, 8, [&](std::string message, bool is_binary) {
    EXPECT_TRUE(is_binary);
    messages.push_back(std::move(message));
  });
  messages.push_back(std::move(last));
  ASSERT_GT(messages.size(), 4u);
  std::vector<bool> seen(std::size_t(draft.axes[2].nodes));
  for (const std::string& message : messages) {
    std::uint32_t length = 0;
    std::memcpy(&length, message.data(), sizeof(length));
    const Json head = Json::parse(message.substr(sizeof(length), length));
    EXPECT_EQ(head["id"], 8);
    EXPECT_EQ(head["axes"][2]["nodes"], draft.axes[2].nodes);
    const auto first = head["slice"].get<std::size_t>(), count = head["slices"].get<std::size_t>();
    const std::vector<int> codes = unpacked(message.substr(sizeof(length) + length), 192, count);
    const std::size_t slice = 192 * 192 * Draft::numbers;
    ASSERT_EQ(codes.size(), count * slice);
    for (std::size_t i = 0; i < codes.size(); ++i) {
      const std::size_t place = i % (count * slice / 4) * 4 + i / (count * slice / 4);
      const double own = value_of(draft.voxels[first * slice + place]);
      // Normal numbers keep six bits of the mantissa, and subnormal numbers multiples of 2^-20.
      ASSERT_NEAR(value_of(static_cast<std::uint16_t>(16 * codes[i])), own,
                  std::max(own * 0x1p-7, 0x1p-21));
    }
    for (std::size_t i = first; i < first + count; ++i) {
      EXPECT_FALSE(seen[i]);
      seen[i] = true;
    }
  }
  EXPECT_EQ(std::count(seen.begin(), seen.end(), true), draft.axes[2].nodes);
}

TEST(Draft, IsRefusedWhereItCannotShowTheView) {
  const auto refused = [](const char* what, const char* with, std::string PageDocument::*text) {
    return problem([&](DraftRequest& request) {
      std::string& own = request.document.*text;
      ASSERT_NE(own.find(what), std::string::npos);
      own.replace(own.find(what), std::strlen(what), with);
    });
  };
  EXPECT_EQ(problem([](DraftRequest&) {}), "");
  EXPECT_EQ(refused("own 1", "own 1 2 3 0 1 1 30 2\nown 1", &PageDocument::scene),
            "a draft shows a scene of one galaxy");
  EXPECT_EQ(refused("[5500, 8000]", "[5500, 6000, 7000, 8000]", &PageDocument::parameters),
            "a draft has at most 3 planes");
  EXPECT_EQ(
      refused("projection = \"orthographic\"\nposition = [0, 0, 9]\nup = [0, 1, 0]\nwidth = 2",
              "projection = \"fisheye\"\nposition = [0, 0, 9]\nup = [0, 1, 0]",
              &PageDocument::parameters),
      "a draft needs a perspective or orthographic camera");
  EXPECT_EQ(problem([](DraftRequest& request) {
              request.document.scene = "galaxy x y z inclination pa\nown 1 2 3 20 30\n";
            }),
            "a draft needs a galaxy that does not turn with the camera");
}

TEST(Draft, IsCancelled) {
  static const Session session(1);
  Cancellation cancellation;
  cancellation.request();
  EXPECT_THROW(make_draft(session, "input", smooth_galaxy(), cancellation), Cancelled);
}

}  // namespace
}  // namespace gamer::draft_test
