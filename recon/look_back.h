#pragma once
// Where the chain of key frames breaks (dark frames, a jump): which earlier ones may show the same
// wall, and where.

#include <map>
#include <opencv2/core/mat.hpp>
#include <vector>

#include "recon/align.h"

namespace rugae {

/// Key frames as they come, small, and which of them hang together. Frames are named by their
/// index.
class LookBack {
 public:
  /// `valid` is Frame::valid.
  explicit LookBack(const cv::Mat& valid);

  /// The next key frame; `gray` CV_8U.
  void add(int frame, const cv::Mat& gray);
  /// Points were followed from one to the other, be they added already or to come.
  void link(int frame, int other);
  /// A chain ends in `last.moving`, the last pair of it.
  void end(const PairAlignment& last);

  struct Candidate {
    int frame = -1;
    cv::Mat flow;  // CV_32FC2, px: a first guess of the flow from it; may be empty
  };
  /// None where `frame`, which was added, hangs together with most of the key frames so far.
  /// Otherwise of the others first the latest end of a chain, if its motion, going on, may not have
  /// left its picture yet, then those that look most like it after a shift, the likest first; at
  /// most `count`.
  std::vector<Candidate> candidates(int frame, std::size_t count) const;

 private:
  int root_of(int frame) const;
  bool with_most(int frame) const;
  std::vector<Candidate> alike(int frame, std::size_t count) const;

  double shrink_;                    // of the pictures
  cv::Mat valid_;                    // small, CV_8U
  cv::Size size_;                    // of the frames
  std::map<int, cv::Mat> seen_;      // CV_8U, light evened
  std::map<int, int> parent_;        // of frames that hang together, a tree
  std::map<int, int> sizes_;         // of each root: how many of them were added
  std::vector<PairAlignment> ends_;  // the last pairs of chains
};

}  // namespace rugae
