#include <gtest/gtest.h>

#include <fstream>

#include "common/error.h"
#include "common/motion/mocap/test/trials_writer.h"
#include "common/testing/temporary_folder.h"

namespace mimesis::mocap {
namespace {

class TrialsFile : public ::testing::Test {
 protected:
  testing::TemporaryFolder dir_;
  std::string file_ = (dir_ / "set.csv").string();

  Trials read(const std::string& text) {
    std::ofstream(file_) << text;
    return read_trials(file_);
  }
  std::string refusal(const std::string& text) {
    try {
      read(text);
    } catch (const ConfigError& e) {
      return std::string(e.what()).substr(dir_.string().size() + 1);
    }
    return "taken";
  }
};

const std::string kHead = "clip,cycle,start_frame,end_frame,duration_s,joint,axis,t0,t1,t2,t3\n";

TEST_F(TrialsFile, TurnsTheAxesOfTheSets) {
  const Trials set = read(kHead +
                          "a,0,1,9,1.5,hip,x,1,2,3,4\n"
                          "a,0,1,9,1.5,hip,y,5,6,7,8\n"
                          "a,0,1,9,1.5,hip,z,9,10,11,12\n");
  EXPECT_EQ(set.rows, (std::vector<std::string>{"hip.x", "hip.y", "hip.z"}));
  EXPECT_EQ(set.samples(0, 0), 9);  // their z is our x
  EXPECT_EQ(set.samples(1, 0), 1);
  EXPECT_EQ(set.samples(2, 3), 8);
  EXPECT_EQ(set.trials[0].duration_s, 1.5);
  EXPECT_EQ(set.trials[0].last_frame, 9);
}

TEST_F(TrialsFile, NamesTheJointsThatTheSetsNumber) {
  const auto joint = [](const std::string& number) {
    return "a,0,1,9,1.5," + number + ",x,1,2,3,4\na,0,1,9,1.5," + number +
           ",y,5,6,7,8\na,0,1,9,1.5," + number + ",z,9,10,11,12\n";
  };
  const Trials set = read(kHead + joint("1") + joint("16"));
  EXPECT_EQ(set.rows,
            (std::vector<std::string>{"lhip.x", "lhip.y", "lhip.z", "rwri.x", "rwri.y", "rwri.z"}));
  EXPECT_EQ(set.samples(3, 0), 9);  // turned all the same
  EXPECT_NE(refusal(kHead + joint("17")).find("joint 17, expected 0 to 16"), std::string::npos);
  const Trials ours = read("# axes: x forward, y left, z up\n" + kHead + joint("1"));
  EXPECT_EQ(ours.rows[0], "1.x");  // our own files name them
}

TEST_F(TrialsFile, ComesBackBitByBit) {
  Trials set;
  set.rows = {"hip.x", "knee", "hip.z"};
  set.task_names = {"distance_m", "depth_m"};
  for (int i = 0; i < 2; ++i) {
    Trial trial;
    trial.clip = "a.bvh";
    trial.cycle = i;
    trial.duration_s = 1.0 / 3.0;
    trial.style = i == 0 ? "brisk" : "";
    trial.step_length_m = 1.0 / 7.0;
    trial.turn_rad = -0.1 * i;
    trial.task = {0.3, 2.0 / 3.0 + i};
    set.trials.push_back(trial);
  }
  set.samples = Eigen::MatrixXd::Random(6, 5);
  write_trials(set, file_);
  const Trials back = read_trials(file_);
  EXPECT_EQ(back.rows, set.rows);
  EXPECT_EQ(back.samples, set.samples);
  EXPECT_EQ(back.trials[1].cycle, 1);
  EXPECT_EQ(back.trials[1].duration_s, 1.0 / 3.0);
  EXPECT_EQ(back.task_names, set.task_names);
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_EQ(back.trials[i].style, set.trials[i].style);
    EXPECT_EQ(back.trials[i].step_length_m, set.trials[i].step_length_m);
    EXPECT_EQ(back.trials[i].turn_rad, set.trials[i].turn_rad);
    EXPECT_EQ(back.trials[i].task, set.trials[i].task);
  }
}

TEST_F(TrialsFile, SaysWhichLineIsWrong) {
  const std::string a = "a,0,1,9,1.5,hip,x,1,2,3,4\n", b = "a,0,1,9,1.5,hip,y,1,2,3,4\n";
  const std::string c = "b,0,1,9,1.5,hip,x,1,2,3,4\n", d = "b,0,1,9,1.5,hip,y,1,2,3,4\n";
  EXPECT_EQ(refusal(kHead + a + b + c + d), "taken");
  EXPECT_EQ(refusal(kHead), "set.csv:1: no trial, expected at least one line below the header");
  EXPECT_EQ(refusal("joint,axis\n").substr(0, 36), "set.csv:1: not a header of trials, e");
  EXPECT_EQ(refusal(kHead + a + b + c),
            "set.csv:4: b, cycle 0: 1 rows, expected 2 as the first trial");
  EXPECT_EQ(refusal(kHead + a + b + c + c), "set.csv:5: row hip.x, expected hip.y");
  EXPECT_EQ(refusal(kHead + a + a), "set.csv:3: row hip.x twice in one trial");
  EXPECT_EQ(refusal(kHead + a + c + a),
            "set.csv:4: a, cycle 0, is there already, expected its lines together");
  EXPECT_EQ(refusal(kHead + "a,0,1,9,1.5,hip,x,1,nan,3,4\n"),
            "set.csv:2: column 9: 'nan', expected a finite number");
  EXPECT_EQ(refusal(kHead + "a,0,1,9,1.5,hip,x,1,2,3\n"),
            "set.csv:2: 10 columns, expected 11 as the header");
  EXPECT_EQ(refusal(kHead + "a,0,1,9,0,hip,x,1,2,3,4\n"),
            "set.csv:2: duration_s: expected more than 0");
  EXPECT_EQ(refusal(kHead + "a,0,1,9,1.5,hip,x,1,2\r,3,4\n"),  // one line, with any content
            "set.csv:2: column 9: '2?', expected a finite number");
  EXPECT_EQ(refusal("").substr(0, 36), "set.csv:0: not a header of trials, e");
  const auto with_columns = [](const std::string& columns, const std::string& cells) {
    return "clip,cycle,start_frame,end_frame,duration_s," + columns +
           "joint,axis,t0,t1,t2,t3\na,0,1,9,1.5," + cells + "hip,x,1,2,3,4\n";
  };
  EXPECT_EQ(refusal(with_columns("depth_m,style,", "0.2,calm,")), "taken");
  EXPECT_EQ(refusal(with_columns("depth_m,style,", "deep,calm,")),
            "set.csv:2: column 6: 'deep', expected a finite number");
  EXPECT_EQ(refusal(with_columns("depth_m,style,", "0.2,")),
            "set.csv:2: 12 columns, expected 13 as the header");
  EXPECT_EQ(refusal(with_columns("depth_m,depth_m,", "0.2,0.2,")),
            "set.csv:1: column 7: 'depth_m' twice, expected each name once");
  EXPECT_EQ(refusal("clip,cycle,start_frame,end_frame,duration_s,depth_m,axis,t0,t1,t2,t3\n")
                .substr(0, 36),
            "set.csv:1: not a header of trials, e");
  EXPECT_THROW(read_trials(file_ + ".none"), ConfigError);
  EXPECT_THROW(read_trials(dir_.string()), ConfigError);
}

}  // namespace
}  // namespace mimesis::mocap
