// SPDX-License-Identifier: Apache-2.0
/// @file
/// The WGS84 ellipsoid: geodetic coordinates, Earth-centred Earth-fixed coordinates, local frames.
#pragma once

#include <cmath>
#include <numbers>
#include <string>

#include <Eigen/Core>

#include "trammel/core/config.hpp"
#include "trammel/core/error.hpp"

namespace trammel::inline TRAMMEL_ABI {

/// Defining constants of the ellipsoid (NIMA TR8350.2, 2000, table 3.1), and what follows from them.
struct Wgs84 {
  static constexpr double kSemiMajorAxis_m = 6378137.0;
  static constexpr double kFlattening = 1.0 / 298.257223563;
  static constexpr double kSemiMinorAxis_m = kSemiMajorAxis_m * (1.0 - kFlattening);
  static constexpr double kEccentricitySquared = kFlattening * (2.0 - kFlattening);
  static constexpr double kAxisRatioSquared = (1.0 - kFlattening) * (1.0 - kFlattening);
};

inline constexpr double kRadiansPerDegree = std::numbers::pi / 180.0;

/// A place by latitude and longitude on the ellipsoid (rad, north and east positive) and height above the
/// ellipsoid along its normal (m). Height above mean sea level is this height minus the geoid undulation.
template <class Scalar>
struct GeodeticPoint {
  Scalar latitude_rad = Scalar(0);
  Scalar longitude_rad = Scalar(0);
  Scalar height_m = Scalar(0);
};

using Geodetic = GeodeticPoint<double>;

/// A place from degrees and metres; Error unless -90 <= latitude <= 90, -360 <= longitude <= 360 and all
/// are finite.
[[nodiscard]] inline Geodetic geodetic_from_degrees(double latitude_deg, double longitude_deg,
                                                    double height_m) {
  if (!(std::abs(latitude_deg) <= 90.0)) {
    throw Error({"latitude", shortest(latitude_deg), "degrees from -90 to 90"});
  }
  if (!(std::abs(longitude_deg) <= 360.0)) {
    throw Error({"longitude", shortest(longitude_deg), "degrees from -360 to 360"});
  }
  if (!std::isfinite(height_m)) {
    throw Error({"height", shortest(height_m), "a finite number of metres"});
  }
  return {latitude_deg * kRadiansPerDegree, longitude_deg * kRadiansPerDegree, height_m};
}

/// Earth-fixed position (m) of a place: with N = a / sqrt(1 - e^2 sin^2 phi),
///   x = (N + h) cos phi cos lambda,  y = (N + h) cos phi sin lambda,  z = (N (1 - e^2) + h) sin phi.
template <class Scalar>
[[nodiscard]] Eigen::Matrix<Scalar, 3, 1> ecef_from_geodetic(const GeodeticPoint<Scalar>& place) {
  using std::cos;
  using std::sin;
  using std::sqrt;
  const Scalar sin_latitude = sin(place.latitude_rad);
  const Scalar cos_latitude = cos(place.latitude_rad);
  const Scalar normal = Scalar(Wgs84::kSemiMajorAxis_m) /
                        sqrt(Scalar(1) - Scalar(Wgs84::kEccentricitySquared) * sin_latitude * sin_latitude);
  const Scalar horizontal = (normal + place.height_m) * cos_latitude;
  return {horizontal * cos(place.longitude_rad), horizontal * sin(place.longitude_rad),
          (normal * Scalar(Wgs84::kAxisRatioSquared) + place.height_m) * sin_latitude};
}

/// Place of an Earth-fixed position (m): the foot point nearest to it on the ellipsoid.
///
/// With P = sqrt(x^2 + y^2)/a, Z = |z|/a and q = 1 - e^2, the foot is (P/(s + e^2), q Z/s) in units of a,
/// where s > 0 solves
///   n(s) = sqrt((P/(s + e^2))^2 + q (Z/s)^2) = 1;
/// then tan phi = (Z/s) / (P/(s + e^2)) and h = a (s - q) |(P/(s + e^2), Z/s)|.
/// Method: Newton's iteration on 1/n(s) - 1, which is concave and increasing, so that it rises to the root
/// from any start on its left: no start value or region fails (the secular equation of Moré and Sorensen
/// 1983, "Computing a trust region step", section 3).
/// Everywhere defined: at the poles and on the axis the longitude is atan2(y, x), 0 on the axis itself;
/// within about 43 km of the centre, where a position may have several feet, the nearest one is taken, and
/// of two equally near ones (z = 0) the northern.
/// Rounding error about 1e-15 rad and 1e-9 m at any height from the centre to the Moon and beyond.
/// Also for automatic differentiation (away from the axis), since the last step is always taken.
template <class Scalar>
[[nodiscard]] GeodeticPoint<Scalar> geodetic_from_ecef(const Eigen::Matrix<Scalar, 3, 1>& p_ecef) {
  using std::abs;
  using std::atan2;
  using std::sqrt;
  const Scalar a(Wgs84::kSemiMajorAxis_m);
  const Scalar e2(Wgs84::kEccentricitySquared);
  const Scalar q(Wgs84::kAxisRatioSquared);
  const Scalar minor_ratio(1.0 - Wgs84::kFlattening);
  const auto length = [](const Scalar& u, const Scalar& v) -> Scalar {  // no 0/0 in derivatives at v = 0
    if (v == Scalar(0)) {
      return abs(u);
    }
    return u == Scalar(0) ? Scalar(abs(v)) : Scalar(sqrt(u * u + v * v));
  };
  const Scalar x = p_ecef[0] / a;
  const Scalar y = p_ecef[1] / a;
  const Scalar equatorial = length(x, y);
  const Scalar axial = p_ecef[2] / a;
  const Scalar polar = axial < Scalar(0) ? Scalar(-axial) : axial;
  Scalar cosine;  // P/(s + e^2) and Z/s: the normal at the foot, not of unit length
  Scalar sine;
  Scalar s(0);
  constexpr double kVanishing = 1e-200;  // far below any length, far above underflow of its square root
  if (polar <= Scalar(kVanishing) && equatorial < e2) {
    cosine = equatorial / e2;  // on the disc inside the evolute: s = 0, Z/s from n = 1
    sine = sqrt((Scalar(1) - cosine) * (Scalar(1) + cosine)) / minor_ratio;
  } else {
    const Scalar from_equatorial = equatorial - e2;
    const Scalar from_polar = minor_ratio * polar;
    s = from_equatorial > from_polar ? from_equatorial : from_polar;  // n >= 1 here: left of the root
    constexpr int kMaxSteps = 100;  // below 8 near the Earth; 1/n bends sharply only near the evolute
    bool last = false;
    for (int step = 0; step < kMaxSteps; ++step) {
      cosine = equatorial / (s + e2);
      sine = polar / s;
      const Scalar n = length(cosine, minor_ratio * sine);
      const Scalar slope = cosine * cosine / (s + e2) + q * sine * sine / s;  // -n n'
      const Scalar next = s + n * n * (n - Scalar(1)) / slope;
      const bool settled = !(next > s * Scalar(1.0 + 1e-15));
      if (next > Scalar(0)) {
        s = next;
      }
      if (settled && last) {
        break;
      }
      last = settled;
    }
    cosine = equatorial / (s + e2);
    sine = polar / s;
  }
  GeodeticPoint<Scalar> place;
  place.height_m = a * (s - q) * length(cosine, sine);
  place.latitude_rad = atan2(axial < Scalar(0) ? Scalar(-sine) : sine, cosine);
  place.longitude_rad = atan2(p_ecef[1], p_ecef[0]);
  return place;
}

/// A local Cartesian frame: x east, y north, z up (along the ellipsoid's normal) about an origin.
///
/// Positions p_local = R (p_ecef - o), velocities v_local = R v_ecef, R orthogonal: both frames turn with
/// the Earth, so a velocity is that over ground in either.
class LocalFrame {
 public:
  explicit LocalFrame(const Geodetic& origin) : origin_(origin), p_ecef_origin_(ecef_from_geodetic(origin)) {
    const double sin_lat = std::sin(origin.latitude_rad);
    const double cos_lat = std::cos(origin.latitude_rad);
    const double sin_lon = std::sin(origin.longitude_rad);
    const double cos_lon = std::cos(origin.longitude_rad);
    r_local_ecef_ << -sin_lon, cos_lon, 0.0,              // east
        -sin_lat * cos_lon, -sin_lat * sin_lon, cos_lat,  // north
        cos_lat * cos_lon, cos_lat * sin_lon, sin_lat;    // up
  }

  [[nodiscard]] const Geodetic& origin() const { return origin_; }
  /// Rotation R from Earth-fixed to local axes, 3 x 3; its rows are east, north, up.
  [[nodiscard]] const Eigen::Matrix3d& r_local_ecef() const { return r_local_ecef_; }

  template <class Scalar>
  [[nodiscard]] Eigen::Matrix<Scalar, 3, 1> local_from_ecef(const Eigen::Matrix<Scalar, 3, 1>& p_ecef) const {
    return r_local_ecef_.template cast<Scalar>() * (p_ecef - p_ecef_origin_.template cast<Scalar>());
  }
  template <class Scalar>
  [[nodiscard]] Eigen::Matrix<Scalar, 3, 1> ecef_from_local(
      const Eigen::Matrix<Scalar, 3, 1>& p_local) const {
    return r_local_ecef_.transpose().template cast<Scalar>() * p_local +
           p_ecef_origin_.template cast<Scalar>();
  }
  template <class Scalar>
  [[nodiscard]] Eigen::Matrix<Scalar, 3, 1> local_from_geodetic(const GeodeticPoint<Scalar>& place) const {
    return local_from_ecef(ecef_from_geodetic(place));
  }
  template <class Scalar>
  [[nodiscard]] GeodeticPoint<Scalar> geodetic_from_local(const Eigen::Matrix<Scalar, 3, 1>& p_local) const {
    return geodetic_from_ecef<Scalar>(ecef_from_local(p_local));
  }
  /// Earth-fixed velocity (m/s) from local axes to Earth-fixed axes.
  [[nodiscard]] Eigen::Vector3d ecef_velocity(const Eigen::Vector3d& v_local_mps) const {
    return r_local_ecef_.transpose() * v_local_mps;
  }
  /// Earth-fixed velocity (m/s) from Earth-fixed axes to local axes.
  [[nodiscard]] Eigen::Vector3d local_velocity(const Eigen::Vector3d& v_ecef_mps) const {
    return r_local_ecef_ * v_ecef_mps;
  }

 private:
  Geodetic origin_;
  Eigen::Vector3d p_ecef_origin_;
  Eigen::Matrix3d r_local_ecef_;
};

}  // namespace trammel::inline TRAMMEL_ABI
