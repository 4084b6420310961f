// SPDX-License-Identifier: Apache-2.0
using System.Linq;
using UnityEditor;
using UnityEditor.SceneManagement;
using UnityEngine;

namespace StereoCell.Samples.Editor
{
    /// <summary>
    /// Makes the scene of this sample around the selected specimens. The sample has no scene file, because a scene file
    /// would refer to your specimen by identifiers that only your editor knows.
    /// </summary>
    public static class CardboardScene
    {
        const string Menu = "GameObject/StereoCell/Cardboard Scene";
        const string ReticleMaterial = "86018f055bc474e3eb8bdb72b5c110fd";  // GUID of Reticle.mat
        const float EyeHeight = 1.4f, Distance = 1, ReticleDistance = 0.6f, ReticleRadius = 0.012f;  // metres

        [MenuItem(Menu, true)]
        static bool HasSpecimen()
        {
            return Chosen().Length > 0;
        }

        [MenuItem(Menu, false, 30)]
        static void Create()
        {
            var chosen = Chosen();
            if (!EditorSceneManager.SaveCurrentModifiedScenesIfUserWantsTo()) return;
            var scene = EditorSceneManager.NewScene(NewSceneSetup.EmptyScene, NewSceneMode.Single);
            Build(chosen);
            EditorSceneManager.SaveScene(scene, AssetDatabase.GenerateUniqueAssetPath("Assets/StereoCell Cardboard.unity"));
        }

        static GameObject[] Chosen()
        {
            return Selection.objects.OfType<GameObject>().Where(each => each.GetComponent<Specimen>() != null).ToArray();
        }

        /// <summary>Add a light, a player with a camera, the specimens and a reticle. Returns the reticle.</summary>
        public static Reticle Build(GameObject[] specimens)
        {
            var light = new GameObject("Light").AddComponent<Light>();
            light.type = LightType.Directional;
            light.transform.rotation = Quaternion.Euler(50, -30, 0);

            var player = new GameObject("Player");
            player.transform.position = new Vector3(0, EyeHeight, -Distance);
            var camera = new GameObject("Main Camera") { tag = "MainCamera" }.AddComponent<Camera>();
            camera.transform.SetParent(player.transform, false);
            camera.nearClipPlane = 0.01f;
            camera.clearFlags = CameraClearFlags.SolidColor;
            camera.backgroundColor = Color.black;
            camera.gameObject.AddComponent<AudioListener>();
            camera.gameObject.AddComponent<HeadPose>();

            var gazes = specimens.Select((specimen, i) => Place(specimen, i, specimens.Length, camera)).ToArray();
            var reticle = new GameObject("Reticle").AddComponent<Reticle>();
            reticle.transform.SetParent(camera.transform, false);
            reticle.transform.localPosition = new Vector3(0, 0, ReticleDistance);
            reticle.transform.localScale = Vector3.one * ReticleRadius;
            reticle.gazes = gazes;
            var renderer = reticle.GetComponent<MeshRenderer>();
            renderer.sharedMaterial = AssetDatabase.LoadAssetAtPath<Material>(AssetDatabase.GUIDToAssetPath(ReticleMaterial));
            return reticle;
        }

        /// <summary>Add a specimen to the scene. Specimens stand side by side, one metre apart.</summary>
        static GazeSwitch Place(GameObject specimen, int index, int count, Camera camera)
        {
            var placed = (GameObject)PrefabUtility.InstantiatePrefab(specimen);
            placed.transform.position = new Vector3(index - (count - 1) / 2f, EyeHeight, 0);
            var gaze = placed.GetComponent<GazeSwitch>();
            gaze.viewer = camera;
            placed.AddComponent<CardboardButton>();
            return gaze;
        }
    }
}
