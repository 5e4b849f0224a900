#include "dataset/flow_explanations.h"

#include <fmt/format.h>

#include "dataset/pose_mistakes.h"

namespace rugae {
namespace {

enum class Part { depth, poses, flow };

struct Mistake {
  Part part;
  std::string text;
  using Undo = std::function<void(FilesReading&)>;
  std::vector<Undo> undos;  // ways to undo it, of which one may do where another finds no files
  bool shift = false;
};

// One part is that of another frame: its file `by` frames later belongs to this frame, or the file
// of this frame to all other parts that many frames before.
Mistake shifted(Part part, const std::string& what, int by) {
  const auto of = [part](FilesReading& r) -> int& {
    return part == Part::depth ? r.depth_of : part == Part::poses ? r.poses_of : r.flow_of;
  };
  return {
      part,
      fmt::format("the {} shifted by one frame: {} of the {}", what,
                  part == Part::poses ? "those" : "that", by < 0 ? "frame before" : "next frame") +
          (part == Part::poses ? " fit" : " fits"),
      {[of, by](FilesReading& r) { of(r) += by; },
       [of, by](FilesReading& r) {
         for (int* other : {&r.depth_of, &r.poses_of, &r.flow_of, &r.wall_of}) *other -= by;
         of(r) += by;
       }},
      true};
}

std::vector<Mistake> all_mistakes() {
  std::vector<Mistake> mistakes = {
      {Part::flow, "the flow's sign is flipped", {[](FilesReading& r) {
         r.flow_sign = -r.flow_sign;
       }}},
      {Part::flow, "the flow's x and y are swapped", {[](FilesReading& r) {
         r.flow_swapped = true;
       }}},
      {Part::flow, "the flow leads to the frame before, not to the next", {[](FilesReading& r) {
         r.flow_to = -1;
       }}},
      {Part::depth, "the depth is the distance along the ray, not along z", {[](FilesReading& r) {
         r.kind = DepthKind::range;
       }}}};
  for (const PoseMistake& mistake : pose_mistakes()) {
    mistakes.push_back({Part::poses,
                        "the poses are wrong: " + mistake.text,
                        {[undo = mistake.undo](FilesReading& r) {
                          const auto first = r.pose;
                          r.pose = [undo, first](const Rigid3& p) {
                            return undo(first ? first(p) : p);
                          };
                        }}});
    // a moving wall tells which of the two lengths is meant
    if (mistake.factor != 1.0)
      mistakes.back().undos.push_back(
          [factor = mistake.factor](FilesReading& r) { r.depth_factor /= factor; });
  }
  for (const int by : {-1, 1}) {
    mistakes.push_back(shifted(Part::depth, "depth is", by));
    mistakes.push_back(shifted(Part::flow, "flow is", by));
    mistakes.push_back(shifted(Part::poses, "poses are", by));
  }
  return mistakes;
}

FlowExplanation explained_by(const std::vector<const Mistake*>& mistakes) {
  FlowExplanation explanation;
  explanation.two_at_once = mistakes.size() > 1;
  explanation.text = explanation.two_at_once ? fmt::format("two mistakes at once: {}, and {}",
                                                           mistakes[0]->text, mistakes[1]->text)
                                             : mistakes[0]->text;
  explanation.readings = {{}};
  for (const Mistake* mistake : mistakes) {
    std::vector<FilesReading> next;
    for (const FilesReading& reading : explanation.readings)
      for (const Mistake::Undo& undo : mistake->undos) undo(next.emplace_back(reading));
    explanation.readings = std::move(next);
  }
  return explanation;
}

std::vector<FlowExplanation> all_explanations() {
  const std::vector<Mistake> mistakes = all_mistakes();
  std::vector<FlowExplanation> list;
  for (const Mistake& m : mistakes) list.push_back(explained_by({&m}));
  for (const Mistake& a : mistakes)
    for (const Mistake& b : mistakes)
      if (a.part < b.part ||
          (&a != &b && a.part == Part::poses && b.part == Part::poses && !(a.shift && b.shift)))
        list.push_back(explained_by({&a, &b}));
  return list;
}

}  // namespace

const std::vector<FlowExplanation>& flow_explanations() {
  static const std::vector<FlowExplanation> all = all_explanations();
  return all;
}

}  // namespace rugae
