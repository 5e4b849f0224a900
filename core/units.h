#pragma once
// Lengths are millimetres, angles radians, times seconds; files for people may say degrees or
// centimetres.

namespace rugae {

inline constexpr double kPi = 3.14159265358979323846;

constexpr double rad_from_deg(double deg) { return deg * (kPi / 180.0); }
constexpr double deg_from_rad(double rad) { return rad * (180.0 / kPi); }
constexpr double mm_from_cm(double cm) { return cm * 10.0; }
constexpr double cm_from_mm(double mm) { return mm / 10.0; }

}  // namespace rugae
