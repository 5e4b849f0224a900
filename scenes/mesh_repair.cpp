#include "scenes/mesh_repair.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <map>
#include <utility>

namespace rugae {
namespace {

std::uint64_t edge_key(int a, int b) {
  return static_cast<std::uint64_t>(std::min(a, b)) << 32 | static_cast<unsigned>(std::max(a, b));
}

struct EdgeUse {
  std::uint64_t key;
  int triangle;
  bool forward;  // from the lower to the higher vertex
};

std::vector<EdgeUse> sorted_edge_uses(const TriangleMesh& mesh) {
  std::vector<EdgeUse> uses;
  uses.reserve(3 * mesh.triangles.size());
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    for (int k = 0; k < 3; ++k) {
      const int a = mesh.triangles[t][k], b = mesh.triangles[t][(k + 1) % 3];
      uses.push_back({edge_key(a, b), static_cast<int>(t), a < b});
    }
  std::sort(uses.begin(), uses.end(), [](const EdgeUse& a, const EdgeUse& b) {
    return a.key != b.key ? a.key < b.key : a.triangle < b.triangle;
  });
  return uses;
}

}  // namespace

TriangleMesh piece_of(const TriangleMesh& mesh, const std::vector<int>& triangles) {
  TriangleMesh piece;
  std::vector<int> index(mesh.vertices.size(), -1);
  for (int t : triangles) {
    Vec3i moved;
    for (int k = 0; k < 3; ++k) {
      int& i = index[mesh.triangles[t][k]];
      if (i < 0) {
        i = static_cast<int>(piece.vertices.size());
        piece.vertices.push_back(mesh.vertices[mesh.triangles[t][k]]);
      }
      moved[k] = i;
    }
    piece.triangles.push_back(moved);
  }
  return piece;
}

int wind_alike(TriangleMesh& mesh) {
  // for every side of every triangle: the neighbour across it, and whether both run along it alike
  const std::size_t count = mesh.triangles.size();
  std::vector<std::vector<std::pair<int, bool>>> neighbours(count);
  const auto uses = sorted_edge_uses(mesh);
  for (std::size_t i = 0; i < uses.size();) {
    std::size_t end = i;
    while (end < uses.size() && uses[end].key == uses[i].key) ++end;
    if (end - i == 2) {
      const bool against = uses[i].forward == uses[i + 1].forward;
      neighbours[uses[i].triangle].emplace_back(uses[i + 1].triangle, against);
      neighbours[uses[i + 1].triangle].emplace_back(uses[i].triangle, against);
    }
    i = end;
  }
  enum : char { unseen, kept, turned };
  std::vector<char> state(count, unseen);
  std::vector<int> open;
  int changes = 0;
  for (std::size_t first = 0; first < count; ++first) {
    if (state[first] != unseen) continue;
    state[first] = kept;
    open.push_back(static_cast<int>(first));
    while (!open.empty()) {
      const int t = open.back();
      open.pop_back();
      for (const auto& [other, against] : neighbours[t]) {
        if (state[other] != unseen) continue;
        state[other] = (state[t] == turned) != against ? turned : kept;
        open.push_back(other);
      }
    }
  }
  for (std::size_t t = 0; t < count; ++t)
    if (state[t] == turned) {
      std::swap(mesh.triangles[t][1], mesh.triangles[t][2]);
      ++changes;
    }
  return changes;
}

void turn_inside_out(TriangleMesh& mesh) {
  for (Vec3i& t : mesh.triangles) std::swap(t[1], t[2]);
  for (Vec3f& n : mesh.normals) n = -n;
}

std::vector<CappedEnd> cap_open_ends(TriangleMesh& mesh) {
  // a border edge, run along against its triangle, leads from one border vertex to the next
  std::multimap<int, int> next;
  const auto uses = sorted_edge_uses(mesh);
  for (std::size_t i = 0; i < uses.size();) {
    std::size_t end = i;
    while (end < uses.size() && uses[end].key == uses[i].key) ++end;
    if (end - i == 1) {
      const int low = static_cast<int>(uses[i].key >> 32);
      const int high = static_cast<int>(uses[i].key & 0xFFFFFFFFu);
      if (uses[i].forward)
        next.emplace(high, low);
      else
        next.emplace(low, high);
    }
    i = end;
  }
  std::vector<CappedEnd> ends;
  while (!next.empty()) {
    // walk until a vertex comes again; the way since then is one border
    std::vector<int> walk{next.begin()->first};
    std::map<int, std::size_t> seen{{walk[0], 0}};
    while (true) {
      const auto step = next.find(walk.back());
      if (step == next.end()) break;  // a border that leads nowhere: left open
      const int to = step->second;
      next.erase(step);
      const auto again = seen.find(to);
      if (again == seen.end()) {
        seen.emplace(to, walk.size());
        walk.push_back(to);
        continue;
      }
      const std::size_t from = again->second;
      CappedEnd cap;
      for (std::size_t i = from; i < walk.size(); ++i) {
        const Vec3& a = mesh.vertices[walk[i]];
        const Vec3& b = mesh.vertices[i + 1 < walk.size() ? walk[i + 1] : to];
        cap.girth_mm += (b - a).norm();
        cap.centre += 0.5 * (b - a).norm() * (a + b);
      }
      cap.centre /= std::max(cap.girth_mm, 1e-12);
      const int middle = static_cast<int>(mesh.vertices.size());
      mesh.vertices.push_back(cap.centre);
      for (std::size_t i = from; i < walk.size(); ++i)
        mesh.triangles.emplace_back(walk[i], i + 1 < walk.size() ? walk[i + 1] : to, middle);
      ends.push_back(cap);
      for (std::size_t i = from + 1; i < walk.size(); ++i) seen.erase(walk[i]);
      walk.resize(from + 1);
      if (from == 0 && next.find(to) == next.end()) break;
    }
  }
  return ends;
}

}  // namespace rugae
