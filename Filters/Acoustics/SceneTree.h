// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include <array>
#include <atomic>
#include <cstdint>
#include <Eigen/Core>
#include <limits>
#include <memory>
#include <vector>

// Embree's
struct RTCDeviceTy;
struct RTCSceneTy;

namespace echorama {

/// Triangles as a tree that rays ask (Embree), in single precision.
class SceneTree {
public:
  /// A ray as the tree takes it.
  struct Line {
    Eigen::Vector3f origin, direction;
    double base = 0.0;                                      ///< where along the ray the origin lies
    double exit = -std::numeric_limits<double>::infinity(); ///< where it leaves the scene's box; before the base: it misses it
  };

  struct Hit {
    float distance; ///< along the line, from its origin
    std::uint32_t triangle;
    Eigen::Vector3f normal; ///< of the triangle, any length
    float u, v;             ///< where in the triangle
  };

  /// \param kept the triangles that it gets; their places in this list are the numbers that hits have
  /// \throws Error(TooLarge), Error(NotPossible)
  SceneTree(const std::vector<Eigen::Vector3f>& points, const std::vector<std::array<std::uint32_t, 3>>& triangles,
            const std::vector<std::uint32_t>& kept);

  /// The first hit from \a near to \a far, and all others up to \a slack behind it, each triangle once, by distance. \returns
  /// false when there is none. Thread safe.
  bool FirstHits(const Line& line, float near, float far, float slack, std::vector<Hit>& hits) const;

  std::int64_t Bytes() const { return *bytes_; }

private:
  struct Release {
    void operator()(RTCDeviceTy* device) const;
    void operator()(RTCSceneTy* scene) const;
  };
  std::unique_ptr<std::atomic<std::int64_t>> bytes_; // before the device that counts in it
  std::unique_ptr<RTCDeviceTy, Release> device_;
  std::unique_ptr<RTCSceneTy, Release> scene_;
};

} // namespace echorama
