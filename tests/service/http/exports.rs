//! Motions in the forms that other programs open, over HTTP.

use serde_json::json;

use super::client::Service;

#[test]
fn a_motion_is_exported_once_its_job_has_ended() {
    let service = Service::with(&["--workers", "1"]);
    let job = service.post_gaits(&json!({ "gait": "trot", "froude": 0.4 }), &json!({ "generations": 2 }));
    // It waits for the first.
    let waiting = service.post_job(&json!({ "generations": 2 }));
    let problem = service.curl(&format!("{waiting}/motion.glb"), &[]).problem(409);
    assert!(problem["detail"].as_str().unwrap().contains("motion.glb"), "{problem}");
    assert_eq!(service.wait_for_end(&job)["state"], "succeeded");

    let glb = service.curl(&format!("{job}/motion.glb"), &[]);
    assert_eq!((glb.status, &*glb.headers["content-type"]), (200, "model/gltf-binary"));
    let file = gltf::Gltf::from_slice(&glb.body).unwrap();
    assert_eq!(file.animations().count(), 3);
    let all = service.curl(&format!("{job}/motions.glb?in_place=true"), &[]);
    assert_eq!((all.status, &*all.headers["content-type"]), (200, "model/gltf-binary"));
    let names =
        |file: &gltf::Gltf| file.animations().map(|one| one.name().unwrap().to_owned()).collect::<Vec<_>>();
    assert_eq!(names(&gltf::Gltf::from_slice(&all.body).unwrap()), ["trot_in_place", "trot_entry"]);
    let unchanged = format!("If-None-Match: {}", all.headers["etag"]);
    let again = service.curl(&format!("{job}/motions.glb?in_place=true"), &["-H", &unchanged]);
    assert_eq!(again.status, 304);
    service.curl(&format!("{job}/motions.glb?fps=0"), &[]).problem(422);
    let bvh = service.curl(&format!("{job}/motion.bvh?in_place=true"), &[]);
    assert_eq!(bvh.status, 200);
    assert!(bvh.text().starts_with("HIERARCHY\nROOT trunk"));
    let rows = |query: &str| {
        let answer = service.curl(&format!("{job}/motion.csv{query}"), &[]);
        assert!(answer.headers["content-type"].starts_with("text/csv"), "{}", answer.text());
        answer.text().lines().filter(|line| line.starts_with("loop,")).count()
    };
    let seconds = service.json(&format!("{job}/motion"))["loop"]["end"].as_f64().unwrap();
    assert_eq!(rows("?fps=100"), (100.0 * seconds).round() as usize + 1);
    assert_eq!(rows(""), (60.0 * seconds).round() as usize + 1);

    // Forms that hold no motion of the root that could stay in place.
    for (extension, media_type, start) in
        [("yaml", "application/yaml", "joint_names"), ("xml", "application/xml", "<mujoco")]
    {
        for place in ["motion", "motions/1"] {
            let answer = service.curl(&format!("{job}/{place}.{extension}"), &[]);
            assert_eq!(
                (answer.status, &*answer.headers["content-type"]),
                (200, media_type),
                "{}",
                answer.text()
            );
            assert!(answer.text().contains(start), "{place}.{extension}");
            service.curl(&format!("{job}/{place}.{extension}?in_place=true"), &[]).problem(422);
        }
    }

    for (query, status) in [("?fps=0", 422), ("?fps=quick", 400), ("?speed=2", 400)] {
        service.curl(&format!("{job}/motion.csv{query}"), &[]).problem(status);
    }
    service.curl(&format!("{job}/motions/1?fps=60"), &[]).problem(400);
    service.curl("/v1/jobs/01890000-0000-7000-8000-000000000000/motion.bvh", &[]).problem(404);
}
