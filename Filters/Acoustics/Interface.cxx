// SPDX-License-Identifier: BSD-3-Clause
#include "Interface.h"
#include <algorithm>
#include <cmath>
#include <Eigen/Geometry>

namespace echorama {

InterfaceResponse MeetInterface(const Fluid& from, const Fluid& to, double cosIncidence)
{
  InterfaceResponse response;
  const double cosine = std::clamp(cosIncidence, 0.0, 1.0), ratio = to.soundSpeed / from.soundSpeed;
  const double sum = from.impedance + to.impedance;
  if (ratio == 1.0) { // no bend: the same at every angle, grazing too
    response.cosTransmitted = cosine;
    response.reflected = (to.impedance - from.impedance) / sum;
    response.reflectedEnergy = response.reflected * response.reflected;
    response.transmittedEnergy = 4.0 * from.impedance * to.impedance / (sum * sum);
    return response;
  }
  const double squared = 1.0 - ratio * ratio * (1.0 - cosine) * (1.0 + cosine);
  const double incoming = to.impedance * cosine;
  if (squared <= 0.0) { // the reflected pressure is (incoming - i lost) / (incoming + i lost)
    const double lost = from.impedance * std::sqrt(-squared);
    response.reflected = incoming >= lost ? 1.0 : -1.0;
    response.reflectedEnergy = 1.0;
    response.transmittedEnergy = 0.0;
    response.cosTransmitted = 0.0;
    response.total = true;
    return response;
  }
  response.cosTransmitted = std::sqrt(squared);
  const double outgoing = from.impedance * response.cosTransmitted, both = incoming + outgoing;
  response.reflected = (incoming - outgoing) / both;
  response.reflectedEnergy = response.reflected * response.reflected;
  response.transmittedEnergy = 4.0 * incoming * outgoing / (both * both);
  return response;
}

double TurnedBack(double cosIncidence, double roughness, double acceptance)
{
  const double angle = std::acos(std::min(1.0, cosIncidence)), square = acceptance * acceptance;
  const double mirror = std::exp(-(1.0 / square) * angle * angle); // energies
  return std::sqrt((1.0 - roughness) * mirror + roughness * std::min(1.0, square) * cosIncidence);
}

Eigen::Vector3d Mirrored(const Eigen::Vector3d& direction, const Eigen::Vector3d& normal)
{
  return (direction - 2.0 * direction.dot(normal) * normal).normalized();
}

Eigen::Vector3d Refracted(const Eigen::Vector3d& direction, const Eigen::Vector3d& normal, double speedRatio,
                          double cosTransmitted)
{
  const double cosine = -direction.dot(normal);
  return (speedRatio * direction + (speedRatio * cosine - cosTransmitted) * normal).normalized();
}

Eigen::Vector3d CarriedThroughBend(const Eigen::Vector3d& across, const Eigen::Vector3d& from, const Eigen::Vector3d& to)
{
  const double cosine = from.dot(to);
  Eigen::Vector3d carried = across;
  if (cosine > -0.999999) { // Rodrigues' formula, with the sine in the axis
    const Eigen::Vector3d axis = from.cross(to);
    carried = cosine * across + axis.cross(across) + axis * (axis.dot(across) / (1.0 + cosine));
  }
  carried -= carried.dot(to) * to; // rounding shall not add up over many bends
  return carried.normalized();
}

} // namespace echorama
